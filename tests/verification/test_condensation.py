"""What holds at every equilibrium of the model: forces, moments, work, and the labels of its equal parts.

The springs see only how parts stand to each other, to the housing and to the sun's angle, which is given. So, whatever
the errors, the contact laws and the clearances:

* Nothing but pins, sun support and carrier bearing pushes the whole mechanism sideways, and together they do not.
* Turned about the housing's centre as one block, it strains pins and meshes: torque on the carrier, moment of the pin
  forces and torque of the sun add up to nothing. The supports stand at the centre and have no lever.
* Turned as the ideal gear train turns, it strains the meshes only: the sun's torque is the carrier's over the ratio i,
  and the housing takes the rest, −T·(1 − 1/i).
* The least energy falls by the rotation per torque: no work is lost.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from studies.benchmarks.plain_rows import spring_groups
from tests.random_cases import Case, random_case, random_reducer, random_unit, seeds
from tests.validation_manual import shown
from tests.verification.dense_twin import DenseModel, dense_model
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.springs import Coordinates
from tolalloc.reducers.reducer.design import Reducer

SEEDS = seeds(40)


class State(NamedTuple):
    """The kernel's equilibrium of one unit at one angle, in all coordinates of the twin's model."""

    model: DenseModel
    coordinates: np.ndarray
    rotation: float


def kernel_state(case: Case, torque: float) -> State:
    """Solve a case's first unit and angle; the coordinates that the kernel does not keep follow from the others."""
    reducer, unit, angle = case.reducer, case.units[0], case.carrier_angle[:1]
    coordinates = Coordinates(reducer.crank_count, reducer.disc_count)
    lever = np.ones(coordinates.count)
    lever[[coordinates.planet(crank) + 2 for crank in range(reducer.crank_count)]] = reducer.planet_base_radius
    lever[[coordinates.disc(disc) + 2 for disc in range(reducer.disc_count)]] = reducer.cycloid_stage.disc_pitch_radius
    lever[coordinates.carrier + 2] = reducer.crank_circle_radius
    groups = spring_groups(reducer, angle, case.orders)
    played = [np.any(group.displacement != 0, axis=(0, 1)) for group in groups if group.contact == "play"]
    discs = np.arange(coordinates.disc(0), coordinates.carrier)
    retained = np.concatenate([discs, np.setdiff1d(np.flatnonzero(np.any(played, axis=0)), discs)]).astype(int)
    rest = np.setdiff1d(np.arange(coordinates.count), retained)

    kernel = EquivalentModel(reducer, orders=case.orders)
    found = kernel.equilibria(np.array([[unit[name] for name in kernel.columns]]), torque, angle)
    assert found.status[0, 0] == Status.CONVERGED, f"no equilibrium found at {torque} N·m"
    dense, q = dense_model(reducer, unit, torque, float(angle[0]), case.orders), np.zeros(coordinates.count)
    q[retained] = found.retained[0, 0] / lever[retained]
    if rest.size:  # only bilateral springs touch these, so one linear solve is exact
        q[rest] = np.linalg.solve(dense.hessian(q)[np.ix_(rest, rest)], -dense.gradient(q)[rest])
    return State(dense, q, float(found.transmission_error[0, 0]))


@pytest.mark.parametrize("seed", SEEDS)
def test_forces_balance_on_every_part(seed):
    case = random_case(seed)
    state = kernel_state(case, case.torque)
    assert state.model.imbalance(state.coordinates) < 1e-9
    assert state.coordinates[-1] == pytest.approx(state.rotation, abs=1e-9 * ARCSECOND, rel=0)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_housing_takes_what_carrier_and_sun_do_not(seed):
    case = random_case(seed)
    reducer, stage, torque = case.reducer, case.reducer.cycloid_stage, case.torque
    state = kernel_state(case, torque)
    forces = state.model.forces(state.coordinates)
    around = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count
    pin = stage.pin_circle_radius * np.exp(1j * around)
    discs = np.arange(reducer.disc_count)[:, np.newaxis]
    crank_direction = 2 * np.pi * discs / reducer.disc_count - stage.disc_teeth * case.carrier_angle[0]
    pole = stage.pin_count * stage.eccentricity * np.exp(1j * crank_direction)
    on_discs = forces["pin contact"].reshape(len(discs), -1) * (pole - pin) / np.abs(pole - pin)
    supports = sum(complex(*forces[name].ravel()) for name in ("sun support", "carrier bearing"))
    largest = max(np.abs(force).max() for force in forces.values())
    assert abs(on_discs.sum() - supports) < 1e-9 * largest
    moment = (pin.conj() * on_discs).imag.sum()
    sun_base_radius = reducer.planet_base_radius * reducer.first_stage.sun_teeth / reducer.first_stage.planet_teeth
    sun_torque = sun_base_radius * forces["gear mesh"].sum()
    tolerance = 1e-9 * largest * stage.pin_circle_radius
    assert torque + moment + sun_torque == pytest.approx(0, abs=tolerance)
    assert sun_torque == pytest.approx(-torque / reducer.ratio, abs=tolerance)
    assert moment == pytest.approx(-torque * (1 - 1 / reducer.ratio), abs=tolerance)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_work_is_lost(seed):
    """The least energy E(T) is concave and −E′ the rotation: its chord lies between the rotations at both ends.

    So the strain energy grows by ∫T dθ: E + T·θ is the strain energy.
    """
    case = random_case(seed)
    torques = case.torque * np.array([0.1, 0.5, 0.999, 1.0, 1.001, 2.0])
    torques.sort()
    states = [kernel_state(case, torque) for torque in torques]
    energy = [state.model.energy(state.coordinates) for state in states]
    chord, rotation = -np.diff(energy) / np.diff(torques), np.array([state.rotation for state in states])
    rounding = 1e-15 * np.abs(energy).max() / np.diff(torques) + 1e-9 * ARCSECOND
    assert (rotation[:-1] - rounding <= chord).all()
    assert (chord <= rotation[1:] + rounding).all()
    assert rotation[-1] - rotation[0] > 100 * rounding.max()  # or the chords would prove nothing


@pytest.mark.parametrize("seed", SEEDS)
def test_all_meshes_alike_turn_the_output_by_the_ratio(seed):
    """A deviation along all lines of action turns the ideal gear train, by 1/(r_b1·i), and strains nothing else."""
    case = random_case(seed)
    reducer, first = case.reducer, case.reducer.first_stage
    sun_base_radius = first.module * first.sun_teeth * np.cos(first.pressure_angle) / 2
    thicker = {f"mesh{crank + 1}.deviation": 1e-6 for crank in range(reducer.crank_count)}
    unit = case.units[0] | {name: case.units[0][name] + value for name, value in thicker.items()}
    before, after = (kernel_state(replace(case, units=(each,)), case.torque) for each in (case.units[0], unit))
    expected = 1e-6 / (sun_base_radius * reducer.ratio)
    assert after.rotation - before.rotation == pytest.approx(expected, abs=1e-7 * ARCSECOND, rel=0)


def test_one_micrometre_at_all_meshes_of_an_rv20e(rv20e, table4):
    unit = table4.copy()
    unit[0, [rv20e.columns.index(f"mesh{crank}.deviation") for crank in (1, 2)]] += 1e-6
    change = rv20e.equilibria(unit, -1.0).transmission_error - rv20e.equilibria(table4, -1.0).transmission_error
    np.testing.assert_allclose(change / ARCSECOND, 0.27873, rtol=0, atol=5e-6)
    shown("C2", float(change.mean()) / ARCSECOND)


def relabelled(reducer: Reducer, unit: dict[str, float]) -> dict[str, float]:
    """Return the unit that stands a crank spacing s = 2π/n further as the given one stands here.

    There crank i is where crank i+1 was, and disc j where disc j+m was. What turns with a part has turned by more; so
    its components in the part's frame turn back. Pins, housing and what is fixed in them stay.
    """
    teeth, cranks, discs = reducer.cycloid_stage.disc_teeth, reducer.crank_count, reducer.disc_count
    spacing, moved = 2 * np.pi / cranks, -teeth * discs // cranks % discs
    turned = {"sun": reducer.ratio * spacing, "crank": -teeth * spacing, "planet": -teeth * spacing}
    # A disc's teeth are counted from its crank direction, in tooth pitches.
    pitches = [(disc + moved) % discs / discs - disc / discs + teeth / cranks for disc in range(discs)]

    def source(name: str) -> str:
        name = re.sub(r"(crank|planet|mesh|bore)(\d+)", lambda at: f"{at[1]}{int(at[2]) % cranks + 1}", name)
        name = re.sub(r"(each_tooth\.\w+\.)(\d+)", lambda at: f"{at[1]}{(int(at[2]) - 1 + tooth) % teeth + 1}", name)
        return re.sub(r"(disc|journal)(\d+)", lambda at: f"{at[1]}{(int(at[2]) - 1 + moved) % discs + 1}", name)

    errors = {}
    for name in unit:
        disc, vector = re.match(r"disc(\d+)", name), re.fullmatch(r"(.*\.)(x|cos(\d+))", name)
        tooth = round(pitches[int(disc[1]) - 1]) if disc else 0
        if re.search(r"\.(y|sin\d+)$", name):
            continue
        if not vector:
            errors[name] = unit[source(name)]
            continue
        other = vector[1] + ("y" if vector[2] == "x" else f"sin{vector[3]}")
        angle = 0.0 if ".assembly" in name else turned.get(re.match("[a-z]*", name)[0], 0.0)
        if disc and vector[3]:
            angle = 2 * np.pi * pitches[int(disc[1]) - 1] / teeth
        elif disc or name.startswith("carrier.bore"):
            angle = spacing
        side = -1 if moved and ".tilt" in name else 1  # discs that change places change sides
        phasor = side * complex(unit[source(name)], unit[source(other)]) * np.exp(-1j * int(vector[3] or 1) * angle)
        errors |= {name: phasor.real, other: phasor.imag}
    return errors


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(("cranks", "discs", "teeth"), [(2, 2, 39), (2, 2, 40), (3, 2, 39), (4, 2, 42), (3, 1, 24)])
def test_equal_parts_may_change_labels(cranks, discs, teeth, seed):
    """Relabelling is exact where a crank spacing turns the crankshafts from one disc's direction to another's."""
    generator, orders = np.random.default_rng(seed), (1, 2, 5)
    any_reducer = random_reducer(generator)
    stage, pins = any_reducer.cycloid_stage, teeth + 1
    eccentricity = stage.shortening * stage.pin_circle_radius / pins
    stage = replace(stage, pin_count=pins, disc_teeth=teeth, eccentricity=eccentricity, pin_radius=0.002)
    reducer = replace(any_reducer, crank_count=cranks, disc_count=discs, cycloid_stage=stage)
    model = EquivalentModel(reducer, orders=orders)
    unit = random_unit(reducer, model.columns, generator)
    units = np.array([[each[name] for name in model.columns] for each in (unit, relabelled(reducer, unit))])
    here = generator.uniform(0, 2 * np.pi, 20)
    first, second = (model.equilibria(units, -10.0, at) for at in (here, here + 2 * np.pi / cranks))
    assert max(first.status.max(), second.status.max()) == Status.CONVERGED
    residual = np.maximum(first.residual[0], second.residual[1])
    difference = np.abs(second.transmission_error[1] - first.transmission_error[0]) / ARCSECOND
    # What is left of the forces moves the softest direction: 1e-6″ at 1e-9 of the largest force, the residual that is
    # promised where a bearing just touches, and in proportion below, down to rounding.
    assert (difference <= 1e-9 + 1e3 * residual).all()
    assert (residual <= 1e-11).mean() > 0.8
    change = second.transmission_error[0] - first.transmission_error[0]
    assert np.abs(change).max() > 0.1 * ARCSECOND  # so the labels do matter
