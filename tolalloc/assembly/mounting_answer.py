"""Which measured part goes where: the fitter's list, and what choosing is worth beside chance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.stock import Mountings, PartStock
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class MountingResult:
    """The mounting that was found."""

    stock: PartStock  # The parts
    mountings: Mountings  # Part and turn at every place of every unit
    # Peak-to-peak of every unit with its parts as they come, infinite where it failed, and as found [arcsec]
    before: Float[np.ndarray, " unit"]
    after: Float[np.ndarray, " unit"]
    # Mean over the units after each step that improved it, from the start that led to the answer [arcsec]
    history: tuple[float, ...]
    # Units evaluated, and those of them without an answer [-]
    evaluations: int
    failures: int


@dataclass(frozen=True, kw_only=True)
class RandomMountings:
    """What the same parts do when nobody chooses."""

    # Peak-to-peak of every unit of every mounting, infinite where it failed [arcsec]
    peak_to_peaks: Float[np.ndarray, "mounting unit"]
    failures: int  # Units without an answer [-]
    every: bool  # Whether these are all mountings there are, each once

    @property
    def means(self) -> Float[np.ndarray, " mounting"]:
        """Mean over the units of each mounting without failures [arcsec]."""
        means = self.peak_to_peaks.mean(axis=1)
        return np.asarray(means[np.isfinite(means)])

    @property
    def mean(self) -> float:
        """Mean over the mountings [arcsec]."""
        return float(self.means.mean())

    @property
    def best(self) -> float:
        """Smallest mean over the units that was met [arcsec]."""
        return float(self.means.min())

    @property
    def worst(self) -> float:
        """Largest mean over the units that was met [arcsec]."""
        return float(self.means.max())


@dataclass(frozen=True, kw_only=True)
class MountingAnswer(Answer):
    """Mounted parts."""

    kind: ClassVar[str] = "mounting"
    torque: float  # Torque on the carrier [N·m]
    found: MountingResult  # The mounting
    chance: RandomMountings  # What the same parts do when nobody chooses

    @property
    def title(self) -> str:
        """Whose parts are mounted."""
        return f"Mounting of {self.header.name}"

    @property
    def subtitle(self) -> str:
        """In which reducer, under which torque."""
        return f"{self.header.model}, {self.torque:g} N·m on the carrier, {len(self.found.stock.parts)} parts"

    @cached_property
    def tables(self) -> dict[str, pd.DataFrame]:
        """The fitter's list, and what every unit does with its parts as they come, and as chosen."""
        import pandas as pd

        found, stock = self.found, self.found.stock
        stands = [(unit, at, place) for unit in range(stock.units) for at, place in enumerate(stock.places)]
        fittings = pd.DataFrame(
            {
                "unit [-]": [unit + 1 for unit, _, _ in stands],
                "place": [place.name for _, _, place in stands],
                "part": [stock.parts[found.mountings[unit, at, 0]].name for unit, at, _ in stands],
                # Bores of a carrier or disc, teeth of the sun, against the part's own frame.
                "turned by, counter-clockwise [steps]": [
                    place.turns[found.mountings[unit, at, 1]].number for unit, at, place in stands
                ],
            }
        )
        units = pd.DataFrame(
            {
                "unit [-]": range(1, stock.units + 1),
                "peak-to-peak as the parts come [arcsec]": found.before,
                "peak-to-peak as mounted [arcsec]": found.after,
            }
        )
        return {"fittings": fittings, "units": units}

    @property
    def sentences(self) -> tuple[str, ...]:
        """What choosing is worth."""
        found, chance = self.found, self.chance
        after, units = float(found.after.mean()), found.stock.units
        whose = "its peak-to-peak" if units == 1 else f"the mean peak-to-peak of {units} units"
        among = (
            f"all {len(chance.means)} mountings there are"
            if chance.every
            else f"{len(chance.means)} random mountings that took as many solved units"
        )
        reach = (
            "Every mounting was tried, so none is better."
            if chance.every
            else f"The best of the random mountings has {chance.best:.1f}″. The list is a local optimum: no assignment "
            "of one kind of part, no turn and no exchange of two parts lowers it; that no other one does is not proven."
        )
        return (
            f"Mounted as listed, {whose} is {after:.1f}″: {1 - after / chance.mean:.0%} below the mean of {among}, "
            f"{1 - after / chance.worst:.0%} below the worst of them ({chance.worst:.1f}″).",
            reach,
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before mounting."""
        failed = self.found.failures + self.chance.failures
        return (f"{failed} units have no equilibrium and were never chosen.",) if failed else ()

    @property
    def sections(self) -> tuple[Section, ...]:
        """Who goes where, and what that is worth beside chance."""
        chance = Figure(
            name="chance",
            title="Mean peak-to-peak when nobody chooses, and as mounted",
            x_label="mean peak-to-peak over the units [arcsec]",
            y_label="share of the mountings [%]",
            series=(Series(label="random mountings", kind="histogram", x=list(self.chance.means)),),
            vertical=((float(self.found.after.mean()), "as mounted"),),
        )
        steps = (
            "A step of a disc or of the carrier is one crank bore, a step of the sun one tooth. The housing has no "
            "choice: turned by whole pins against the rest it changes no peak-to-peak."
        )
        return (
            Section(heading="Who goes where", paragraphs=(steps,), tables=tuple(self.tables.items())),
            Section(heading="Beside chance", figures=(chance,)),
        )

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states, of the reducer and of how its parts are measured and mounted."""
        return (
            *self.header.assumptions,
            "errors that the file does not state are zero, and measured ones are exact",
            "discs and cranks are not turned over, planets stay on their cranks, bearing rings stay in their seats",
        )

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units in the names."""
        found, chance = self.found, self.chance
        return {
            "parts": self.header.name,
            "reducer": self.header.model,
            "torque [N·m]": self.torque,
            "seed": self.header.seed,
            "units [-]": found.stock.units,
            "mean peak-to-peak as mounted [arcsec]": float(found.after.mean()),
            "mean of random mountings [arcsec]": chance.mean,
            "worst random mounting [arcsec]": chance.worst,
            "every mounting tried": chance.every,
            "fittings": self.tables["fittings"].to_dict("records"),
            "units": self.tables["units"].to_dict("records"),
            "units solved [-]": found.evaluations,
            "units failed [-]": found.failures,
            "warnings": list(self.warnings),
        }
