"""Eight samples to a register: the logarithm, and line contact with the same bits alone and among others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import prepared, seeded_units
from tests.random_cases import random_units
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.cycloid.solvers.pins import pin_force
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.solvers.batch import (
    BATCH,
    ROW,
    make_batch,
    make_history,
    present,
    solve_batch_at,
    start_next,
)
from tolalloc.reducers.equivalent.solvers.contact_solver import solve_at_node, values_of
from tolalloc.reducers.equivalent.solvers.play import make_play
from tolalloc.reducers.equivalent.solvers.pressing import DEEPEST, line_contact
from tolalloc.reducers.equivalent.solvers.simd import WIDTH, aligned, load, logarithm, spread, store
from tolalloc.reducers.equivalent.solvers.workspace import make_memory
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.running.compiled import jit


@jit
def logarithms(numbers, found):
    for at in range(0, numbers.size, WIDTH):
        store(found, at, logarithm(load(numbers, at)))


@jit
def line_contacts(stiffness, log_length, depth, force, slope, far):
    for at in range(0, depth.size, WIDTH):
        own_force, own_slope, own_far = line_contact(spread(stiffness), spread(log_length), load(depth, at))
        store(force, at, own_force)
        store(slope, at, own_slope)
        far[at // WIDTH] = own_far


def test_logarithms_are_those_of_numpy_within_two_units_in_the_last_place(generator):
    numbers = np.concatenate(
        [
            np.exp(generator.uniform(-690, 690, 4000)),
            generator.uniform(0.5, 2.0, 4000),
            1.0 + generator.uniform(-1e-9, 1e-9, 1000),
            [1.0, np.sqrt(0.5), np.nextafter(np.sqrt(0.5), 0), np.sqrt(2.0), 0.5, 2.0, 1e-300, 1e300],
        ]
    )
    found, expected = np.empty_like(numbers), np.log(numbers)
    logarithms(numbers, found)
    assert (np.abs(found - expected) <= 2 * np.spacing(np.abs(expected))).all()
    assert found[-8] == 0.0


@pytest.mark.parametrize("log_length", [np.log(0.01), np.log(0.3), np.log(0.1) + 12.0, np.log(0.1) + 120.0])
def test_line_contact_is_the_law_of_one_pin(log_length, generator):
    depth = np.sort(np.exp(generator.uniform(np.log(1e-16), np.log(3e-3), 4000)))
    force, slope, far = np.empty_like(depth), np.empty_like(depth), np.empty(depth.size // WIDTH, np.int64)
    line_contacts(2.5e8, log_length, depth, force, slope, far)
    expected = np.array([pin_force(1, 2.5e8, log_length, 0.0, own) for own in depth])
    deep = log_length - np.log(depth) < DEEPEST
    said = ((far[:, np.newaxis] >> np.arange(WIDTH)) & 1).astype(bool).ravel()
    np.testing.assert_array_equal(said, deep)
    np.testing.assert_allclose(force[~deep], expected[~deep, 0], rtol=2e-14)
    np.testing.assert_allclose(slope[~deep], expected[~deep, 1], rtol=1e-13)


def reducer_of(name: str, clearance: float) -> Reducer:
    """Return a preset, with a clearance of its crank–disc bearings [m]; the holes of `cd29` have theirs anyway."""
    reducer = load_reducer(name)
    return (
        replace(reducer, clearances=replace(reducer.clearances, crank_disc_bearing=clearance)) if clearance else reducer
    )


def errors_of(model: EquivalentModel, count: int, generator: np.random.Generator) -> np.ndarray:
    """Return units whose errors are normal, σ a micrometre or a microradian, but for the discs' tilt."""
    errors = 1e-6 * generator.standard_normal((count, len(model.columns)))
    errors[:, ["tilt" in name for name in model.columns]] = 0.0
    for name, amount in model.reducer.modification.deviations.items():
        errors[:, model.columns.index(name)] = amount
    return errors


@pytest.mark.parametrize(("name", "clearance"), [("rv20e", 0.0), ("rv20e", 2e-6), ("cd29", 0.0)])
def test_units_have_the_same_bits_alone_and_among_others(name, clearance, generator):
    model, angles = EquivalentModel(reducer_of(name, clearance)), 2 * np.pi * np.arange(30) / 936
    errors = errors_of(model, 21, generator)
    together = model.equilibria(errors, -1.0, angles)
    assert (together.status == Status.CONVERGED).all()
    for rows in (slice(0, 1), slice(5, 14), slice(20, 21)):
        apart = model.equilibria(errors[rows], -1.0, angles)
        np.testing.assert_array_equal(apart.transmission_error, together.transmission_error[rows])
        np.testing.assert_array_equal(apart.retained, together.retained[rows])


@pytest.mark.parametrize(("name", "clearance", "torque"), [("rv20e", 2e-6, -5.0), ("cd29", 0.0, -1.0)])
def test_units_with_play_settle_in_their_register_where_the_solver_for_one_sample_does(
    name, clearance, torque, generator
):
    """From rest, which is farther than any guess; a wrong tangent would leave them to the solver for one sample."""
    model, samples, angle = EquivalentModel(reducer_of(name, clearance)), 64, np.array([0.3])
    columns, tables, law = model.error_columns, model.tables_at(angle), model.design.law
    layout, careful, size = columns.layout, np.empty(BATCH, np.bool_), tables.load.shape[2]
    values = np.empty((samples, layout.end))
    values_of(errors_of(model, samples, generator), torque, layout, columns.map, values)
    batch = make_batch(layout, size, tables.contact_stiffness.shape[1], ROW)
    play = make_play(size, tables.play_stiffness.shape[1], ROW)
    batch.values[:, :samples] = values.T
    loads = layout.torque + 1
    rows = present(batch.values, 0, loads, loads)
    waves = present(batch.values, layout.wave, layout.tooth, layout.waves)
    solve_batch_at(law, (0, 0), 0, tables, layout, rows, waves, True, True, samples, batch, play, careful)
    settled, memory = np.flatnonzero(~careful[:samples]), make_memory(law, tables)
    assert settled.size > 0.9 * samples
    assert batch.ratio[settled].max() <= 1e-11
    for s in settled:
        start, face_width = np.zeros(size), model.design.face_width
        rotation, status, *_ = solve_at_node(0, tables, layout, face_width, values[s], start, *memory[:2])
        assert status == Status.CONVERGED
        assert batch.rotation[s] == pytest.approx(rotation, rel=0, abs=1e-6 * ARCSECOND)


def test_nearly_all_samples_settle_in_their_register(rv20e, table4, generator):
    """A wrong tangent or balance would leave them to the solver for one sample: the same answers, many times slower."""
    units, angle = random_units(table4, rv20e.columns, generator, BATCH), np.array([0.3])
    columns, tables = rv20e.error_columns, rv20e.tables_at(angle)
    layout, careful = columns.layout, np.empty(BATCH, np.bool_)
    values = np.empty((BATCH, layout.end))
    values_of(units, -1.0, layout, columns.map, values)
    batch = make_batch(layout, tables.load.shape[2], tables.contact_stiffness.shape[1], ROW)
    batch.values[:, :BATCH] = values.T
    loads = layout.torque + 1
    rows = present(batch.values, 0, loads, loads)
    waves = present(batch.values, layout.wave, layout.tooth, layout.waves)
    teeth_deviate = np.any(batch.values[layout.tooth : layout.tilt] != 0.0)
    given = (tables, layout, rows, waves, teeth_deviate, np.any(batch.values[layout.flank] != 0.0))
    solve_batch_at(LINEAR, (0, 0), 0, *given, BATCH, batch, None, careful)
    settled = ~careful
    found = rv20e.equilibria(units, -1.0, angle).transmission_error[:, 0]
    np.testing.assert_allclose(batch.rotation[:BATCH][settled], found[settled], rtol=1e-9)
    assert careful.mean() < 0.1


def test_what_repeats_with_the_crank_and_changes_evenly_is_guessed_exactly(generator):
    """And what changes along a line, where a crank's turn is no whole number of angles or has not passed twice."""
    turn, size, used, angles = 5, 6, 16, 30
    repeated, change = generator.normal(size=(turn, size, ROW)), generator.normal(size=(size, ROW))
    curve = np.array([repeated[angle % turn] + angle * change for angle in range(angles)])
    q, history = aligned(size, ROW), make_history(turn, size)
    for angle in range(angles - 1):
        q[:] = curve[angle]
        start_next(angle, turn, used, q, history)
        if angle >= 2 * turn:
            np.testing.assert_allclose(q[:, :used], curve[angle + 1, :, :used], rtol=1e-12, atol=1e-12)
    q, history = aligned(size, ROW), make_history(0, size)
    for angle in range(4):
        q[:] = repeated[0] + angle * change
        start_next(angle, 0, used, q, history)
        expected = repeated[0] + (angle + 1) * change if angle else repeated[0]
        np.testing.assert_allclose(q[:, :used], expected[:, :used], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["rv20e_liu2020", "rv20e"])
def test_guesses_from_turns_of_the_crank_are_nearer_and_lead_to_the_same_equilibria(name):
    study = prepared(reducer={"name": name})
    model, units = study.model.kernel.model, seeded_units(study.errors, 24)
    errors, angles = study.model.kernel.errors(units), 2 * np.pi * np.arange(936) / 936
    by_turns, by_lines = model.equilibria(errors, -1.0), model.equilibria(errors, -1.0, angles)
    assert (by_turns.status == by_lines.status).all()
    np.testing.assert_allclose(by_turns.transmission_error, by_lines.transmission_error, rtol=0, atol=1e-9 * ARCSECOND)

    def off(turn: int) -> float:
        q, history, found = aligned(6, ROW), make_history(turn, 6), []
        for angle in range(935):
            q[:, :24] = by_turns.retained[:, angle].T
            start_next(angle, turn, 24, q, history)
            found.append(np.abs(q[:, :24] - by_turns.retained[:, angle + 1].T))
        return float(np.median(found[48:]))

    assert off(24) < 0.3 * off(0)
