"""Which measured part goes where: the fitter's list, and what choosing is worth beside chance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd

from tolalloc.assembly.mounting.results import MountingResult, RandomMountings
from tolalloc.report.document import Document, Section
from tolalloc.report.figure import Figure, Series


@dataclass(frozen=True, kw_only=True)
class MountingResults:
    """Mounted parts.

    Parameters
    ----------
    name
        Where the parts come from.
    torque
        Torque on the carrier [N·m].
    found
        The mounting.
    chance
        What the same parts do when nobody chooses.
    seed
        Seed of the random numbers [-].
    """

    name: str
    torque: float
    found: MountingResult
    chance: RandomMountings
    seed: int


def fitting_table(results: MountingResults) -> pd.DataFrame:
    """Return the fitter's list."""
    return pd.DataFrame(
        {
            "unit [-]": [fitting.unit for fitting in results.found.fittings],
            "place": [fitting.place for fitting in results.found.fittings],
            "part": [fitting.part for fitting in results.found.fittings],
            "turned by, counter-clockwise [steps]": [fitting.turn for fitting in results.found.fittings],
        }
    )


def unit_table(results: MountingResults) -> pd.DataFrame:
    """Return what every unit does with its parts as they come, and as chosen."""
    found = results.found
    return pd.DataFrame(
        {
            "unit [-]": range(1, found.stock.units + 1),
            "peak-to-peak as the parts come [arcsec]": found.before,
            "peak-to-peak as mounted [arcsec]": found.after,
        }
    )


def answer(results: MountingResults) -> tuple[str, ...]:
    """Return what choosing is worth, in sentences."""
    found, chance = results.found, results.chance
    after, units = float(found.after.mean()), found.stock.units
    whose = "its peak-to-peak" if units == 1 else f"the mean peak-to-peak of {units} units"
    among = (
        f"all {len(chance.means)} mountings there are"
        if chance.every
        else f"{len(chance.means)} random mountings that took as many solved units"
    )
    sentences = [
        f"Mounted as listed, {whose} is {after:.1f}″: {1 - after / chance.mean:.0%} below the mean of {among}, "
        f"{1 - after / chance.worst:.0%} below the worst of them ({chance.worst:.1f}″)."
    ]
    if chance.every:
        sentences.append("Every mounting was tried, so none is better.")
    else:
        sentences.append(
            f"The best of the random mountings has {chance.best:.1f}″. The list is a local optimum: no assignment of "
            "one kind of part, no turn and no exchange of two parts lowers it; that no other one does is not proven."
        )
    return tuple(sentences)


def warnings(results: MountingResults) -> tuple[str, ...]:
    """Return what a reader must know before mounting."""
    failed = results.found.failures + results.chance.failures
    return (f"{failed} units have no equilibrium and were never chosen.",) if failed else ()


def summary(results: MountingResults) -> dict[str, Any]:
    """Return the answer for a program, units in the names."""
    found, chance = results.found, results.chance
    return {
        "parts": results.name,
        "reducer": found.stock.reducer.name,
        "torque [N·m]": results.torque,
        "seed": results.seed,
        "units [-]": found.stock.units,
        "mean peak-to-peak as mounted [arcsec]": float(found.after.mean()),
        "mean of random mountings [arcsec]": chance.mean,
        "worst random mounting [arcsec]": chance.worst,
        "every mounting tried": chance.every,
        "fittings": fitting_table(results).to_dict("records"),
        "units": unit_table(results).to_dict("records"),
        "units solved [-]": found.evaluations,
        "units failed [-]": found.failures,
        "warnings": list(warnings(results)),
    }


def mounting_document(results: MountingResults) -> Document:
    """Return the report."""
    found, chance = results.found, results.chance
    return Document(
        title=f"Mounting of {results.name}",
        subtitle=f"{found.stock.reducer.name}, {results.torque:g} N·m on the carrier, {len(found.stock.parts)} parts",
        answer=answer(results),
        warnings=warnings(results),
        sections=(
            Section(
                heading="Who goes where",
                paragraphs=(
                    "A step of a disc or of the carrier is one crank bore, a step of the sun one tooth. The housing "
                    "has no choice: turned by whole pins against the rest it changes no peak-to-peak.",
                ),
                tables=(("fittings", fitting_table(results)), ("units", unit_table(results))),
            ),
            Section(
                heading="Beside chance",
                figures=(
                    Figure(
                        name="chance",
                        title="Mean peak-to-peak when nobody chooses, and as mounted",
                        x_label="mean peak-to-peak over the units [arcsec]",
                        y_label="mountings [-]",
                        series=(Series(label="random mountings", kind="histogram", x=list(chance.means)),),
                        vertical=((float(found.after.mean()), "as mounted"),),
                    ),
                ),
            ),
        ),
        assumptions=(
            *found.stock.reducer.assumptions,
            "errors that the file does not state are zero, and measured ones are exact",
            "discs and cranks are not turned over, planets stay on their cranks, bearing rings stay in their seats",
        ),
        summary=summary(results),
        seed=results.seed,
    )
