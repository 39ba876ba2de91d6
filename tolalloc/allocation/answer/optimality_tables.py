"""The tables of how far from optimal a drawing is: certificate, bounds and fronts; a unit in every header."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from tolalloc.allocation.answer.tables import searches, solver_noise
from tolalloc.allocation.front.pareto_front import Front, Fronts
from tolalloc.allocation.search.candidates import GRADES
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.wording import short

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer


def certificate_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return cost, lower bound and the cheapest design of the local model of every search."""
    rows: list[dict[str, object]] = [
        {
            "search": label,
            "verified cost [cost units]": found.chosen.cost,
            "lower bound, 95 % [cost units]": found.bound,
            "verified cost above the lower bound [%]": found.gap * 100,
            "lower bound holds for": "every drawing" if found.lower_bound.certified else "drawings near by",
            "cheapest by the local model, at the limits [cost units]": found.optimum.cost + found.locked_cost,
            "cheapest by the local model, inside [cost units]": found.inside.cost + found.locked_cost,
            "gap of the convex program [-]": found.optimum.gap,
            "designs verified [-]": len(found.tried),
        }
        for label, found in searches(answer).items()
    ]
    graded = answer.graded
    if graded:
        rows.append(
            {
                "search": GRADES,
                "verified cost [cost units]": graded.chosen.cost,
                "lower bound, 95 % [cost units]": graded.bound,
                "verified cost above the lower bound [%]": (graded.chosen.cost / graded.bound - 1) * 100,
                "lower bound holds for": "choices near by",
                "cheapest by the local model, at the limits [cost units]": graded.solution.cost
                + graded.space.locked_cost,
                "gap of the convex program [-]": graded.solution.gap,
                "designs verified [-]": len(graded.tried),
            }
        )
    return pd.DataFrame(rows)


def bounds_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return what the smallest and the largest zones, of process and tolerance table together, cost free zones."""
    space, found = answer.space, answer.free
    zones, scales = space.first_zones / MICROMETRE, found.optimum.zones
    made = [feature.processes[at] for feature, at in zip(space.features, found.optimum.processes, strict=True)]
    noise = solver_noise(found.optimum)
    saved = found.optimum.bound_prices * scales[:, np.newaxis]  # had the bound moved by its own size
    prices = np.where(saved > noise, found.optimum.bound_prices, 0.0) / zones[:, np.newaxis]
    return pd.DataFrame(
        {
            "group": space.groups,
            "process": [process.name for process in made],
            "smallest of process and table [µm]": [process.minimum for process in made] * zones,
            "cheapest zone of the models [µm]": scales * zones,
            "largest of process and table [µm]": [process.maximum for process in made] * zones,
            "marginal price of the smallest [cost units/µm]": prices[:, 0],
            "marginal price of the largest [cost units/µm]": prices[:, 1],
        }
    )


def front_tables(answer: AllocationAnswer, fronts: Fronts) -> tuple[tuple[str, pd.DataFrame], ...]:
    """Return the exact front with its bound, and the searched ones with what the real model says of them."""
    unit = unit_of(answer.leading)
    kept = f"{short(answer.leading)} kept, told [{unit}]"
    groups, searched = len(answer.drawn.groups), fronts.searched
    exact = pd.DataFrame(
        {
            f"{short(answer.leading)} limit [{unit}]": fronts.exact.limits,
            "cost [cost units]": fronts.exact.cost,
            "proven for the local model [cost units]": fronts.exact.bound,
        }
    )
    found = pd.DataFrame({kept: searched.quantile, f"on the kernel [{unit}]": searched.on_kernel})
    found["cost [cost units]"] = searched.cost
    for at, name in enumerate(answer.drawn.shared.names):
        found[name] = searched.designs[:, groups + at]
    found["knee"] = _knees(searched)
    tables = (("front", exact), ("searched front", found))
    front = fronts.with_setting
    if front is None:
        return tables
    third = pd.DataFrame({"cost [cost units]": front.cost, kept: front.quantile})
    third[f"on the kernel [{unit}]"] = front.on_kernel
    third[answer.drawn.shared.names[-1]] = front.further[:, 0]
    third["knee"] = _knees(front)
    return (*tables, ("front with clearance", third))


def _knees(front: Front) -> list[str]:
    """Return where the knee of a front stands."""
    return ["yes" if at == front.knee else "" for at in range(front.cost.size)]
