"""A simulated reducer: what an engine leaves over time, the numbers of its steady part, and what they say."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reading.units import ARCSECOND, DEGREE, RPM
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.simulation.figures import error_figure, run_figures
from tolalloc.reducers.simulation.sentences import range_text, sentences, warnings
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class TimeSeries:
    """A reducer over time."""

    time: Float[np.ndarray, " time"]  # Equally spaced times [s]
    carrier_angle: Float[np.ndarray, " time"]  # θc of the nominal motion [rad]
    # Of the sun gear, as prescribed [rad/s, rad/s²]
    input_speed: Float[np.ndarray, " time"]
    input_acceleration: Float[np.ndarray, " time"]
    # Of the carrier [rad/s, rad/s²]
    output_speed: Float[np.ndarray, " time"]
    output_acceleration: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, " time"]  # Carrier rotation beyond θc, output side [rad]
    input_torque: Float[np.ndarray, " time"]  # On the sun gear, positive where it drives [N·m]
    output_torque: Float[np.ndarray, " time"]  # On the carrier; negative resists the rotation [N·m]
    pin_forces: Float[np.ndarray, "time disc pin"]  # Normal force between every pin and every disc [N]

    @property
    def pins_in_contact(self) -> Int[np.ndarray, "time disc"]:
        """Pins that carry, on each disc [-]."""
        return np.asarray((self.pin_forces > 0).sum(axis=2))


@dataclass(frozen=True, kw_only=True)
class AtRest:
    """The static model at carrier angles of the steady part, under its torque."""

    steps: Int[np.ndarray, " angle"]  # Numbers of the time steps with these angles [-]
    transmission_error: Float[np.ndarray, " angle"]  # Carrier rotation beyond θc, output side [rad]
    pin_forces: Float[np.ndarray, "angle disc pin"]  # Normal force between every pin and every disc [N]
    seconds: float  # Computing time [s]


@dataclass(frozen=True, kw_only=True)
class SimulationAnswer(Answer):
    """A simulated reducer; the header's name is the unit's."""

    kind: ClassVar[str] = "simulation"
    reducer: Reducer  # Nominal design as simulated
    engine: str  # Who integrated
    speed: float  # Input speed that is reached [rad/s]
    torque: float  # Torque on the carrier at the end; negative resists the rotation [N·m]
    series: TimeSeries  # Over the whole time
    steady: slice  # Time steps of the last whole crank turns under constant speed and load
    crank_turns: int  # How many these are [-]
    at_rest: AtRest  # The static model beside it
    # Lowest natural frequency over the steady part; none where springs are not linear [Hz]
    natural_frequency: float | None
    seconds: float  # Computing time of the simulation [s]

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"{self.header.model} in motion"

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        return (
            f"unit {self.header.name}, {self.speed / RPM:g} rpm at the input, {self.torque:g} N·m on the carrier, "
            f"{self.engine}, {self.series.time.size - 1} steps of {self.step:.3g} s"
        )

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""
        return sentences(self)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return warnings(self)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs, figures and tables."""
        return (
            Section(
                heading="The last whole crank turns",
                paragraphs=("At rest is the static model at the same carrier angles and torque.",),
                figures=(error_figure({self.engine: self}, passes=20),),
                tables=(("steady", self.steady_table),),
            ),
            Section(
                heading="The whole run",
                paragraphs=(
                    "Lines show the least and the most of every stretch; series.csv beside this page has every step.",
                ),
                figures=run_figures(self),
            ),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""
        return {
            "reducer": self.header.model,
            "unit": self.header.name,
            "input speed [rpm]": self.speed / RPM,
            "torque on the carrier [N·m]": self.torque,
            "duration [s]": float(self.series.time[-1]),
            "step [s]": self.step,
            "crank turns of the steady part [-]": self.crank_turns,
            "input power [W]": self.input_power,
            "output power [W]": self.output_power,
            "pin pass [Hz]": self.pin_pass,
            "lowest natural frequency [Hz]": self.natural_frequency,
            "in motion": self.steady_row,
            "at rest": self.rest_row,
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

    def add_files(self, folder: Path) -> None:
        """Add every time step to a written report."""
        self.series_table.to_csv(folder / "series.csv", index=False)

    @property
    def steady_row(self) -> dict[str, object]:
        """One line of a table of engines: the steady part in motion."""
        difference = self.difference / ARCSECOND
        return {
            "engine": self.engine,
            "mean transmission error [arcsec]": float(self.transmission_error.mean() / ARCSECOND),
            "peak-to-peak [arcsec]": self.peak_to_peak[0] / ARCSECOND,
            "beside rest, rms [arcsec]": float((difference**2).mean() ** 0.5),
            "beside rest, largest [arcsec]": float(abs(difference).max()),
            **_contact_cells(self.contacts),
            "largest pin force [N]": self.largest_force[0],
            "output speed [rpm]": self.output_speed / RPM,
            "ratio [-]": self.ratio,
            "power out over power in [%]": 100 * self.output_power / self.input_power,
            "computing time [s]": self.seconds,
        }

    @property
    def rest_row(self) -> dict[str, object]:
        """The line of the static model in the same table."""
        return {
            "engine": "at rest",
            "mean transmission error [arcsec]": float(self.at_rest.transmission_error.mean() / ARCSECOND),
            "peak-to-peak [arcsec]": self.peak_to_peak[1] / ARCSECOND,
            **_contact_cells(self.contacts_at_rest),
            "largest pin force [N]": self.largest_force[1],
            "computing time [s]": self.at_rest.seconds,
        }

    @cached_property
    def steady_table(self) -> pd.DataFrame:
        """The steady part in motion and at rest, one quantity per row."""
        import pandas as pd

        moving, resting = self.steady_row, self.rest_row
        names = [name for name in moving if name != "engine"]
        return pd.DataFrame(
            {
                "quantity": names,
                "in motion": [moving[name] for name in names],
                "at rest": [resting.get(name, "") for name in names],
            }
        )

    @cached_property
    def series_table(self) -> pd.DataFrame:
        """Everything over time, units in the headers."""
        import pandas as pd

        series, contacts = self.series, self.series.pins_in_contact
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

    @property
    def step(self) -> float:
        """Time step [s]."""
        return float(self.series.time[1] - self.series.time[0])

    @property
    def pin_pass(self) -> float:
        """How often per second a disc passes a pin [Hz]."""
        stage = self.reducer.cycloid_stage
        return self.speed / (2 * np.pi) / self.reducer.ratio * stage.disc_teeth * stage.pin_count

    @property
    def span(self) -> float:
        """Carrier angle over which the steady part goes [rad]."""
        return self.crank_turns * 2 * np.pi / self.reducer.cycloid_stage.disc_teeth

    @property
    def output_speed(self) -> float:
        """Mean speed of the carrier in the steady part [rad/s]."""
        return float(self.series.output_speed[self.steady].mean())

    @property
    def ratio(self) -> float:
        """Mean input speed over mean output speed in the steady part [-]."""
        return float(self.series.input_speed[self.steady].mean() / self.output_speed)

    @property
    def input_power(self) -> float:
        """Mean power that the sun gear brings in [W]."""
        return float((self.series.input_torque * self.series.input_speed)[self.steady].mean())

    @property
    def output_power(self) -> float:
        """Mean power that the carrier gives away [W]."""
        return float(-(self.series.output_torque * self.series.output_speed)[self.steady].mean())

    @property
    def transmission_error(self) -> Float[np.ndarray, " angle"]:
        """Transmission error where the static model has its own [rad]."""
        return np.asarray(self.series.transmission_error[self.at_rest.steps])

    @property
    def peak_to_peak(self) -> tuple[float, float]:
        """Peak-to-peak transmission error in motion and at rest, at the same angles [rad]."""
        return float(np.ptp(self.transmission_error)), float(np.ptp(self.at_rest.transmission_error))

    @property
    def difference(self) -> Float[np.ndarray, " angle"]:
        """What motion adds to the transmission error [rad]."""
        return np.asarray(self.transmission_error - self.at_rest.transmission_error)

    @property
    def largest_force(self) -> tuple[float, float]:
        """Largest force of a pin in motion and at rest, at the same angles [N]."""
        return float(self.series.pin_forces[self.at_rest.steps].max()), float(self.at_rest.pin_forces.max())

    @property
    def contacts(self) -> tuple[tuple[int, int], ...]:
        """Least and most pins that carry in the steady part, disc by disc [-]."""
        counts = self.series.pins_in_contact[self.steady]
        return tuple(zip(counts.min(axis=0).tolist(), counts.max(axis=0).tolist(), strict=True))

    @property
    def contacts_at_rest(self) -> tuple[tuple[int, int], ...]:
        """The same in the static model [-]."""
        counts = (self.at_rest.pin_forces > 0).sum(axis=2)
        return tuple(zip(counts.min(axis=0).tolist(), counts.max(axis=0).tolist(), strict=True))

    @property
    def arcseconds(self) -> tuple[Float[np.ndarray, " angle"], ...]:
        """Carrier angle [deg], transmission error in motion and at rest [arcsec]."""
        angle = self.series.carrier_angle[self.at_rest.steps] / DEGREE
        return angle, self.transmission_error / ARCSECOND, self.at_rest.transmission_error / ARCSECOND


def _contact_cells(contacts: tuple[tuple[int, int], ...]) -> dict[str, str]:
    """Return how many pins carry as cells of a table, disc by disc."""
    return {f"pins in contact, disc {disc + 1} [-]": range_text(*counts) for disc, counts in enumerate(contacts)}
