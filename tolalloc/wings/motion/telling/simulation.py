"""A simulated reducer: its steady part beside the static model, and the whole run over time."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from tolalloc.reading.units import ARCSECOND, DEGREE, RPM
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.wings.motion.motion import ASSUMPTIONS
from tolalloc.wings.motion.simulation import SimulationResult, rms

if TYPE_CHECKING:
    import pandas as pd

_say = Sentences("simulation", "tolalloc.wings.motion")
COARSE = 20
"""Time steps per pin pass below which a wave is not drawn well [-]."""
NEAR = 1.25
"""Ratio of an excitation to the lowest natural frequency, up or down, that counts as near [-]."""
_POINTS = 2000
"""Points of a line, about two for every dot of a screen; the file of the whole series has all [-]."""
_PASSES = 20
"""Pin passes of the steady part that are drawn [-]."""
_PROTOTYPE = "exudyn"


class SimulationTeller(Teller[SimulationResult]):
    """What is said of a simulated reducer; the header's name is the unit's."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", model=self.header.model)

    @property
    def subtitle(self) -> str:
        """Unit, speed, torque, engine and steps."""
        found = self.result
        return _say(
            "subtitle",
            unit=self.header.name,
            speed=found.prepared.speed / RPM,
            torque=found.prepared.torque,
            engine=found.engine,
            steps=found.series.time.size - 1,
            step=found.step,
        )

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """Ratio and power, pins, transmission error, and where the difference comes from."""
        found = self.result
        moving, resting = found.largest_force
        spans, spans_at_rest = (span / ARCSECOND for span in found.peak_to_peak)
        difference = found.difference / ARCSECOND
        counts = (_say("on_disc", disc=at, range=range_text(*both)) for at, both in enumerate(found.contacts, start=1))
        return (
            _say(
                "turns",
                turns=_say("more_turns", count=found.prepared.crank_turns)
                if found.prepared.crank_turns > 1
                else _say("one_turn"),
                begins=found.series.time[found.steady.start - 1],
                output_speed=found.output_speed / RPM,
                ratio=found.ratio,
                entering=found.input_power,
                leaving=100 * found.output_power / found.input_power,
            ),
            _say("contacts", counts="; ".join(counts), contact=self._contact, moving=moving, resting=resting),
            _say(
                "spans",
                moving=spans,
                resting=spans_at_rest,
                angle=found.span / DEGREE,
                rms=rms(difference),
                largest=np.abs(difference).max(),
            ),
            self._cause,
        )

    @property
    def _contact(self) -> str:
        """What the pin contacts are."""
        stiffness, stage = self.result.prepared.reducer.stiffness, self.result.prepared.reducer.cycloid_stage
        if stiffness.pin_contact_law == "logarithmic":
            return _say("steel", width=stage.face_width * 1e3)
        return _say("constant", stiffness=stiffness.pin_contact, law=stiffness.pin_contact_law)

    @property
    def _cause(self) -> str:
        """What the difference from the static model comes from."""
        found, lowest = self.result, self.result.natural_frequency
        frequency = _say("no_frequency")
        if lowest is not None:
            near = [name for name, often in found.excitations.items() if 1 / NEAR < often / lowest < NEAR]
            verdict = _say("near", excitations=" and ".join(near)) if near else _say("away")
            frequency = _say("frequency", frequency=lowest, verdict=verdict)
        cause = _say("prototype_differs") if found.engine == _PROTOTYPE else _say("motion_alone")
        return _say("passes", often=found.pin_pass, frequency=frequency, cause=cause)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What vibrates, has not settled, is cut off or lasts too short."""
        found, said = self.result, []
        if found.ringing:
            said.append(_say("ringing", what=found.ringing, step=found.step))
        if found.is_unsettled:
            said.append(_say("unsettled"))
        if (passes := 1 / (found.pin_pass * found.step)) < COARSE:
            said.append(_say("coarse", step=found.step, share=1 / passes))
        if found.span < 2 * np.pi and self.header.name != "exact":
            said.append(_say("short", angle=found.span / DEGREE, turn=2 * np.pi / found.output_speed))
        return tuple(said)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What neither the files of reducer and unit print nor any source of masses, damping and load."""
        asked, prototype = self.result.prepared.asked, self.result.engine == _PROTOTYPE
        damping = _say(
            "damping",
            stiffness=asked.damping,
            stiffened="bearings" if prototype else "meshes and bearings",
            mass=self.result.prepared.mass_damping,
            damped="the carrier's rotation alone" if prototype else "every part",
        )
        return (
            *self.header.assumptions,
            *((_say("pin_stiffness", stiffness=asked.pin_stiffness),) if asked.pin_stiffness is not None else ()),
            *ASSUMPTIONS,
            _say("output_inertia", inertia=asked.output_inertia),
            damping,
            _say("rise"),
            _say("frictionless"),
            *((_say("ideal_gears"),) if prototype else ()),
        )

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The steady part, and the whole run."""
        return (
            Section(
                heading=_say("steady_heading"),
                paragraphs=(_say("at_rest"),),
                figures=(error_figure({self.result.engine: self.result}, passes=_PASSES),),
                tables=(("steady", self.steady_table),),
            ),
            Section(heading=_say("run_heading"), paragraphs=(_say("thinned"),), figures=run_figures(self.result)),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The steady part in motion and at rest, units of measurement in the names."""
        found = self.result
        return {
            "reducer": self.header.model,
            "unit": self.header.name,
            "input speed [rpm]": found.prepared.speed / RPM,
            "torque on the carrier [N·m]": found.prepared.torque,
            "duration [s]": float(found.series.time[-1]),
            "step [s]": found.step,
            "crank turns of the steady part [-]": found.prepared.crank_turns,
            "input power [W]": found.input_power,
            "output power [W]": found.output_power,
            "pin pass [Hz]": found.pin_pass,
            "lowest natural frequency [Hz]": found.natural_frequency,
            "in motion": steady_row(found),
            "at rest": rest_row(found),
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """The steady part in motion and at rest."""
        return ((self.steady_table, _say("steady_on_terminal", model=self.header.model)),)

    def add_files(self, folder: Path) -> None:
        """Add every time step to a written report."""
        series_table(self.result).to_csv(folder / "series.csv", index=False)

    @cached_property
    def steady_table(self) -> pd.DataFrame:
        """The steady part in motion and at rest, one quantity per row."""
        import pandas as pd

        resting = rest_row(self.result)
        rows = [(name, own, resting.get(name, "")) for name, own in steady_row(self.result).items() if name != "engine"]
        return pd.DataFrame(rows, columns=["quantity", "in motion", "at rest"])


def range_text(least: int, most: int) -> str:
    """Return a range of counts as people write it."""
    return f"{least}" if least == most else f"{least}…{most}"


def steady_row(found: SimulationResult) -> dict[str, object]:
    """Return one line of a table of engines: the steady part in motion."""
    difference = found.difference / ARCSECOND
    return {
        "engine": found.engine,
        "mean transmission error [arcsec]": float(found.transmission_error.mean() / ARCSECOND),
        "peak-to-peak [arcsec]": found.peak_to_peak[0] / ARCSECOND,
        "beside rest, rms [arcsec]": float((difference**2).mean() ** 0.5),
        "beside rest, largest [arcsec]": float(abs(difference).max()),
        **_contact_cells(found.contacts),
        "largest pin force [N]": found.largest_force[0],
        "output speed [rpm]": found.output_speed / RPM,
        "ratio [-]": found.ratio,
        "power out over power in [%]": 100 * found.output_power / found.input_power,
        "computing time [s]": found.seconds,
    }


def rest_row(found: SimulationResult) -> dict[str, object]:
    """Return the line of the static model in the same table."""
    return {
        "engine": "at rest",
        "mean transmission error [arcsec]": float(found.at_rest.transmission_error.mean() / ARCSECOND),
        "peak-to-peak [arcsec]": found.peak_to_peak[1] / ARCSECOND,
        **_contact_cells(found.contacts_at_rest),
        "largest pin force [N]": found.largest_force[1],
        "computing time [s]": found.at_rest.seconds,
    }


def _contact_cells(contacts: tuple[tuple[int, int], ...]) -> dict[str, str]:
    """Return how many pins carry as cells of a table, disc by disc."""
    return {f"pins in contact, disc {at} [-]": range_text(*counts) for at, counts in enumerate(contacts, start=1)}


def series_table(found: SimulationResult) -> pd.DataFrame:
    """Return everything over time, units in the headers."""
    import pandas as pd

    series, contacts = found.series, found.series.pins_in_contact
    return pd.DataFrame(
        {
            "time [s]": series.time,
            "carrier angle [deg]": series.carrier_angle / DEGREE,
            "input speed [rpm]": series.input_speed / RPM,
            "output speed [rpm]": series.output_speed / RPM,
            "output acceleration [rad/s²]": series.output_acceleration,
            "transmission error [arcsec]": series.transmission_error / ARCSECOND,
            **{f"pins in contact, disc {disc + 1} [-]": contacts[:, disc] for disc in range(contacts.shape[1])},
            "input torque [N·m]": series.input_torque,
            "output torque [N·m]": series.output_torque,
        }
    )


def _thinned(values: Shaped[np.ndarray, " time"]) -> Int[np.ndarray, " shown"]:
    """Return which points show a line: least and most of each stretch, so that no vibration hides between them."""
    stretches = np.array_split(np.arange(values.size), min(_POINTS // 2, values.size))
    ends = [(part[np.argmin(values[part])], part[np.argmax(values[part])]) for part in stretches]
    return np.unique(np.array(ends))


def line(label: str, x: Float[np.ndarray, " time"], y: Shaped[np.ndarray, " time"]) -> Series:
    """Return a line thin enough for a page."""
    shown = _thinned(y)
    return Series(label=label, kind="line", x=x[shown].tolist(), y=y[shown].tolist())


def _over_time(name: str, title: str, label: str, *lines: Series) -> Figure:
    return Figure(name=name, title=title, x_label="time [s]", y_label=label, series=lines)


def run_figures(found: SimulationResult) -> tuple[Figure, ...]:
    """Return the whole run over time: input and output speed, their accelerations, contacts of each disc."""
    series, contacts, engine = found.series, found.series.pins_in_contact, found.engine
    figures = []
    for kind, said, label, factor in (
        ("speed", "speed_figure", "speed [rpm]", RPM),
        ("acceleration", "acceleration_figure", "angular acceleration [rad/s²]", 1.0),
    ):
        for part in ("input", "output"):
            values = getattr(series, f"{part}_{kind}") / factor
            title = _say(said, part=part)
            figures.append(_over_time(f"{part}_{kind}", title, label, line(engine, series.time, values)))
    discs = (line(f"disc {disc + 1}", series.time, contacts[:, disc]) for disc in range(contacts.shape[1]))
    return (*figures, _over_time("contacts", _say("contact_figure"), "pins in contact [-]", *discs))


def error_figure(found: Mapping[str, SimulationResult], passes: int | None = None) -> Figure:
    """Return the transmission error over the last pin passes of the steady part, of several engines and at rest."""
    first = next(iter(found.values()))
    stage = first.prepared.reducer.cycloid_stage
    shown = (np.inf if passes is None else passes) * 360.0 / (stage.disc_teeth * stage.pin_count)
    curves = [(label, result, result.transmission_error) for label, result in found.items()]
    curves.append(("at rest", first, first.at_rest.transmission_error))
    lines = []
    for label, result, error in curves:
        angle = result.series.carrier_angle[result.at_rest.steps] / DEGREE
        last = angle >= angle[-1] - shown
        lines.append(line(label, angle[last], error[last] / ARCSECOND))
    return Figure(
        name="transmission_error",
        title=_say("error_figure"),
        x_label="carrier angle [°]",
        y_label="transmission error [″]",
        series=tuple(lines),
    )
