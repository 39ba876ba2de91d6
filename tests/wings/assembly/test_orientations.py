"""Final orientations of an assembly as errors of the reducer, and what they do to its transmission."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.model import Response
from tolalloc.reading.units import ARCSECOND, MEGAPASCAL, MILLIMETRE
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.wings.assembly.chain import ChainPart, DatumFlowChain
from tolalloc.wings.assembly.control import regulator
from tolalloc.wings.assembly.files import load_plan
from tolalloc.wings.assembly.orientations import OrientationResponse, transmission_curves
from tolalloc.wings.assembly.trajectory import foreseen

LOAD = "largest line load, rated torque [N/mm]"


@pytest.fixture(scope="module")
def plan():
    return load_plan("bx40e")


@pytest.fixture(scope="module")
def response(plan):
    reducer = load_reducer(plan.reducer)
    model = EquivalentModel(reducer, AngleSearch(coarse=156))
    return OrientationResponse(model=model, chain=plan.chain, torque=reducer.load.test_torque)


@pytest.fixture(scope="module")
def x(response):
    uniform = next(SeedTree(3).uniform_chunks(5, len(response.columns)))
    return (2 * uniform - 1) * 60 * ARCSECOND


def named(response, x):
    found = response(x)
    assert found.good.all()
    return dict(zip(response.outputs, found.values.T, strict=True))


def test_it_is_a_response_over_the_states(response, plan):
    assert isinstance(response, Response)
    assert len(response.columns) == plan.space.states
    assert response.columns[:4] == ("KC1.x", "KC1.y", "KC1.z", "KC2.x")


def test_the_errors_are_those_of_the_chain_and_the_modification_alone(response, x):
    errors = dict(zip(response.model.columns, response.errors(x).T, strict=True))
    moved = response.chain.columns(x.reshape(-1, 4, 3))
    np.testing.assert_array_equal(errors["disc2.tilt.x"], x[:, response.columns.index("KC4.x")])
    np.testing.assert_array_equal(errors["crank1.journal2.phase"], x[:, response.columns.index("KC1.z")])
    modification = response.model.reducer.modification.deviations
    for name, values in errors.items():
        np.testing.assert_array_equal(values, moved.get(name, np.full(5, modification.get(name, 0.0))))


def test_its_outputs_are_those_of_the_model(response, x):
    values, model, errors = named(response, x), response.model, response.errors(x)
    rated = -abs(model.reducer.load.rated_torque)
    for torque, name in ((response.torque, ""), (rated, ", rated torque")):
        found = model.extremes(errors, torque).peak_to_peak / ARCSECOND
        np.testing.assert_array_equal(values[f"peak-to-peak transmission error{name} [arcsec]"], found)
    mean = model.equilibria(errors, response.torque).transmission_error.mean(axis=1)
    np.testing.assert_array_equal(values["mean transmission error [arcsec]"], mean / ARCSECOND)
    solved = Solved.of(model.equilibria(errors, rated))
    pins = solved.forces.pins
    np.testing.assert_array_equal(values["largest pin force, rated torque [N]"], pins.max(axis=(1, 2, 3)))
    of_disc = pins.sum(axis=3).max(axis=(1, 2))
    np.testing.assert_allclose(values["largest sum of pin forces of a disc, rated torque [N]"], of_disc, rtol=1e-14)
    load = solved.line_load.max(axis=(1, 2, 3)) * MILLIMETRE
    np.testing.assert_allclose(values[LOAD], load, rtol=1e-14)
    touching = (pins > 0).sum(axis=(2, 3)).mean(axis=1)
    np.testing.assert_allclose(values["pins in contact, mean, rated torque [-]"], touching, rtol=1e-3)


def test_curves_over_the_turn_have_the_largest_values_of_the_response(response, x):
    values, load = named(response, x), response.model.reducer.load
    curves = transmission_curves(response.model, response.errors(x), -abs(load.rated_torque))
    assert curves.status.max() == 0
    np.testing.assert_array_equal(curves.pin_force.max(axis=1), values["largest pin force, rated torque [N]"])
    pressure = curves.pressure.max(axis=1) / MEGAPASCAL
    np.testing.assert_array_equal(pressure, values["peak pressure, rated torque [MPa]"])
    width = np.ptp(curves.transmission_error, axis=1) / ARCSECOND
    refined = values["peak-to-peak transmission error, rated torque [arcsec]"]
    assert (width <= refined + 1e-9).all()


@pytest.mark.slow
def test_a_sample_keeps_its_bits_in_other_company(response):
    uniform = next(SeedTree(4).uniform_chunks(70, len(response.columns)))
    x, quick = (2 * uniform - 1) * 60 * ARCSECOND, replace(response, readings=response.readings[1:])
    np.testing.assert_array_equal(quick(x[62:66]).values, quick(x).values[62:66])


def test_every_status_is_told_and_a_failed_sample_fails_alone(response, x):
    seen, broken = [], x.copy()
    broken[2, 5] = np.nan
    found = replace(response, observe=seen.append)(broken)
    assert np.flatnonzero(~found.good).tolist() == [2]
    assert np.concatenate(seen).tolist() == found.status.tolist()


def chain_with(**own):
    return DatumFlowChain(datum="KC0", parts=(ChainPart(name="KC1", on="KC0", **own),))


@pytest.mark.parametrize(
    ("own", "sentence"),
    [
        ({"tilts": ("disc3.tilt",)}, "'disc3.tilt.x'; allowed is an error column of a reducer with 2 discs"),
        ({"rotates": ("crank1.phase",)}, "'crank1.phase'; allowed is an error column"),
        ({}, r"\[\]; allowed is at least one column"),
    ],
)
def test_columns_that_the_model_does_not_have_are_refused(response, own, sentence):
    with pytest.raises(InputError, match=sentence):
        replace(response, chain=chain_with(**own))


def test_a_law_that_knows_no_tilt_of_discs_is_refused(response, plan):
    reducer = response.model.reducer
    soft = replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law="logarithmic"))
    with pytest.raises(InputError, match=r"disc1\.tilt\.x.*'logarithmic'; allowed is constant or table2"):
        replace(response, model=EquivalentModel(soft))
    replace(response, model=EquivalentModel(soft), chain=chain_with(tilts=("crank1.tilt",)))


def line_loads(response, plan, draws):
    """Largest line load of random assemblies [draw, Q], without adjustment and with more and more of it."""
    uniform = next(SeedTree(5).child("draws").uniform_chunks(draws, plan.space.states))
    errors = (2 * uniform - 1) * 60 * ARCSECOND
    plans = [regulator(plan.space, plan.final_weight(q)) for q in (0.0, 0.5, 1.0, 2.0, 5.0, 10.0)]
    final = np.stack([foreseen(plan.space, own, errors).adjusted[:, -1] for own in plans], axis=1)
    loaded = replace(response, readings=response.readings[1:])
    return named(loaded, final.reshape(-1, plan.space.states))[LOAD].reshape(draws, len(plans))


@pytest.mark.slow
@pytest.mark.parametrize("rotations", [True, False], ids=["with rotations", "tilts alone"])
def test_adjusting_lowers_the_largest_line_load_of_every_assembly(response, plan, rotations):
    parts = tuple(part if rotations else replace(part, rotates=()) for part in plan.chain.parts)
    load = line_loads(replace(response, chain=replace(plan.chain, parts=parts)), plan, 40)
    assert (load[:, -1] < load[:, 0]).all()
    # From Q to Q one disc may tilt more than before: of 4000 steps 14 went up; 7 of 200 would be seven standard errors.
    assert np.count_nonzero(np.diff(load, axis=1) >= 0) < 7


def test_a_length_is_no_angle(response):
    chain = DatumFlowChain(datum="KC0", parts=(ChainPart(name="KC1", on="KC0", rotates=("disc2.bore1.position.x",)),))
    with pytest.raises(InputError, match=r"column is 'disc2.bore1.position.x'; allowed is an angle, whose source ends"):
        OrientationResponse(model=response.model, chain=chain, torque=response.torque)
