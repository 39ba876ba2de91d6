"""Sentences, tables and figures of the report on a simulated reducer: made-up series with known numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import says
from tolalloc.reading.units import ARCSECOND, RPM
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.reports.header import Header
from tolalloc.wings.motion.simulation import AtRest, PreparedSimulation, SimulationRequest, SimulationResult, TimeSeries
from tolalloc.wings.motion.telling.simulation import SimulationTeller, error_figure, line, range_text, series_table

RATIO, SPEED, LOAD, STEP = 81.0, 525 * RPM, 572.0, 1e-4
TIMES = 5001
PASS = 525 / 60 / RATIO * 39 * 40


def results(lost: float = 0.0, added: float = 0.0, spike: float = 0.0, wobble: float = 0.0) -> SimulationResult:
    """Steady throughout; the transmission error is a pin pass of 0.2″ with a little added by motion."""
    time = STEP * np.arange(TIMES)
    wave, ones = 0.1 * np.sin(2 * np.pi * PASS * time) * ARCSECOND, np.ones(TIMES)
    alternating = wobble * (-1.0) ** np.arange(TIMES) * ARCSECOND
    pins = np.zeros((TIMES, 2, 40))
    pins[:, 0, :4], pins[:, 1, :5] = 900.0, 1000.0
    pins[::7, 0, 4] = 10.0
    at_rest = pins[2501:].copy()
    pins[4000, 1, 0] += spike
    series = TimeSeries(
        time=time,
        carrier_angle=SPEED / RATIO * time,
        input_speed=SPEED * ones,
        input_acceleration=0 * ones,
        output_speed=SPEED / RATIO * ones,
        output_acceleration=np.cos(2 * np.pi * PASS * time),
        transmission_error=wave + added * ARCSECOND + alternating,
        input_torque=LOAD / RATIO / (1 - lost) * ones,
        output_torque=-LOAD * ones,
        pin_forces=pins,
    )
    return SimulationResult(
        prepared=PreparedSimulation(
            asked=SimulationRequest(engine="newmark", speed_rpm=SPEED / RPM, duration=1.8, mass_damping=500.0),
            reducer=load_reducer("rv40e_xi2015"),
            unit=load_unit("exact"),
            torque=-LOAD,
        ),
        series=series,
        steady=slice(2501, TIMES),
        at_rest=AtRest(steps=np.arange(2501, TIMES), transmission_error=wave[2501:], pin_forces=at_rest, seconds=0.1),
        natural_frequency=4500.0,
        seconds=1.0,
    )


def by_engine(found: SimulationResult, engine: str) -> SimulationResult:
    prepared = replace(found.prepared, asked=replace(found.prepared.asked, engine=engine))
    return replace(found, prepared=prepared)


def told(found: SimulationResult, unit: str = "exact") -> SimulationTeller:
    return SimulationTeller(found, Header(name=unit, model="RV-40E", assumptions=("steel",)))


def test_numbers_of_the_steady_part():
    found = results(lost=0.02, added=0.05, spike=25.0)
    assert found.ratio == pytest.approx(RATIO)
    assert found.output_speed / RPM == pytest.approx(525 / 81)
    assert found.output_power / found.input_power == pytest.approx(0.98)
    assert found.output_power == pytest.approx(LOAD * SPEED / RATIO)
    assert found.peak_to_peak == pytest.approx([0.2 * ARCSECOND, 0.2 * ARCSECOND], rel=1e-3)
    assert np.abs(found.difference).max() == pytest.approx(0.05 * ARCSECOND)
    assert found.largest_force == (1025.0, 1000.0)
    assert found.contacts == ((4, 5), (5, 5)) == found.contacts_at_rest
    assert found.pin_pass == pytest.approx(168.5, abs=0.02)


def test_the_answer_says_what_is_found_and_why():
    said = " ".join(told(results(lost=0.02, added=0.05, spike=25.0)).sentences)
    assert says(said, "simulation.turns", output_speed=525 / 81, ratio=81.0, leaving=98.0)
    assert says(said, "simulation.contacts", counts="disc 1: 4…5; disc 2: 5", moving=1025.0, resting=1000.0)
    assert says(said, "simulation.constant", stiffness=2.12e9, law="constant")
    assert says(said, "simulation.spans", rms=0.05, largest=0.05)
    assert says(said, "simulation.frequency", frequency=4500.0)
    for key in ("one_turn", "away", "motion_alone"):
        assert says(said, f"simulation.{key}")
    for frequency, what in ((200.0, "1 times the pin pass"), (8.0, "order 78 and order 80")):
        found = told(replace(results(), natural_frequency=frequency))
        assert says(found.sentences, "simulation.near", excitations=what)
    assert says(told(replace(results(), natural_frequency=None)).sentences, "simulation.no_frequency")
    prototype = told(by_engine(results(), "exudyn"))
    assert says(prototype.sentences, "simulation.prototype_differs")


def test_vibrations_of_the_step_are_not_taken_for_the_reducers():
    assert told(results()).warnings == ()
    assert results(wobble=0.02).ringing == "transmission error"
    assert says(told(results(wobble=0.02)).warnings[0], "simulation.ringing", what="transmission error")
    calm = results()
    turning = replace(calm.series, output_acceleration=(-1.0) ** np.arange(TIMES))
    assert says(told(replace(calm, series=turning)).warnings[0], "simulation.ringing", what="output acceleration")


@pytest.mark.parametrize("lost", [0.01, -0.01])
def test_power_that_does_not_close_is_said(lost):
    assert results(lost=lost).is_unsettled
    assert says(told(results(lost=lost)).warnings[0], "simulation.unsettled")


def test_a_deviation_that_decays_is_said():
    calm = results()
    decaying = 5 * ARCSECOND * np.exp(-np.arange(TIMES) / 1000) * np.cos(0.02 * np.arange(TIMES))
    series = replace(calm.series, transmission_error=calm.series.transmission_error + decaying)
    assert replace(calm, series=series).is_unsettled
    assert not calm.is_unsettled


def test_a_short_stretch_is_said_for_a_unit_with_errors():
    found = told(results(), "table4").warnings
    assert len(found) == 1
    assert "9.3 s" in found[0]


def test_tables_have_every_step_and_both_sides():
    found = results()
    series = series_table(found)
    assert len(series) == TIMES
    assert all("[" in name for name in series)
    assert series["transmission error [arcsec]"].abs().max() == pytest.approx(0.1, rel=1e-3)
    steady = told(found).steady_table.set_index("quantity")
    assert steady.loc["largest pin force [N]"].tolist() == [1000.0, 1000.0]
    assert steady.loc["ratio [-]", "at rest"] == ""
    assert (range_text(4, 4), range_text(4, 5)) == ("4", "4…5")


def test_a_thinned_line_keeps_every_peak():
    x, y = np.arange(50_000.0), np.zeros(50_000)
    y[31_234] = 1.0
    thin = line("peak", x, y)
    assert len(thin.x) <= 2000
    assert max(thin.y) == 1.0
    assert thin.x[int(np.argmax(thin.y))] == 31_234.0


def test_figures_show_as_many_pin_passes_as_asked():
    figure = error_figure({"newmark": results()}, passes=3)
    assert [series.label for series in figure.series] == ["newmark", "at rest"]
    span = figure.series[0].x[-1] - figure.series[0].x[0]
    assert span == pytest.approx(3 * 360 / 39 / 40, rel=0.02)


def test_the_document_names_its_load_and_engine():
    document = told(results()).document
    assert "525 rpm" in document.subtitle
    assert "−572 N·m" in document.subtitle
    assert document.summary["in motion"]["engine"] == "newmark"
    assert [figure.name for figure in document.sections[1].figures][-1] == "contacts"
