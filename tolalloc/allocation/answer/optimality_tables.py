"""The tables of how far from optimal a drawing is: certificate, bounds and fronts; a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.allocation.answer.tables import solver_noise
from tolalloc.units import MICROMETRE


def certificate_table(results: AllocationResults) -> pd.DataFrame:
    """Return cost, certified bound and gap of every search, at the limits and one standard error inside them."""
    searches = {"tolerances alone": results.alone, "tolerances and modification": results.joint}
    rows: list[dict[str, object]] = [
        {
            "search": label,
            "verified cost [cost units]": found.chosen.cost,
            "cheapest of the models, at the limits [cost units]": found.optimum.cost + found.locked_cost,
            "certified bound, at the limits [cost units]": found.bound,
            "gap of the program, at the limits [-]": found.optimum.gap,
            "cheapest of the models, inside [cost units]": found.inside.cost + found.locked_cost,
            "certified bound, inside [cost units]": found.inside.bound + found.locked_cost,
            "gap of the program, inside [-]": found.inside.gap,
            "verified cost above the bound at the limits [%]": found.gap * 100,
            "of that for the margin [%]": (found.inside.cost - found.optimum.cost) / found.bound * 100,
            "designs verified [-]": len(found.tried),
        }
        for label, found in searches.items()
    ]
    graded = results.graded
    if graded:
        locked = graded.space.locked_cost
        rows.append(
            {
                "search": "grades",
                "verified cost [cost units]": graded.chosen.cost,
                "cheapest of the models, at the limits [cost units]": graded.solution.cost + locked,
                "certified bound, at the limits [cost units]": graded.bound,
                "gap of the program, at the limits [-]": graded.solution.gap,
                "verified cost above the bound at the limits [%]": (graded.chosen.cost / graded.bound - 1) * 100,
                "designs verified [-]": len(graded.tried),
            }
        )
    return pd.DataFrame(rows)


def bounds_table(results: AllocationResults) -> pd.DataFrame:
    """Return what the smallest and the largest zones, of process and tolerance table together, cost free zones."""
    space, found = results.space, results.joint
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


def searched_table(results: AllocationResults) -> pd.DataFrame:
    """Return the front of the search with what the kernel says of it, its knee marked."""
    front = results.fronts.searched
    return pd.DataFrame(
        {
            "peak-to-peak kept, told [arcsec]": front.quantile,
            "on the kernel [arcsec]": front.on_kernel,
            "cost [cost units]": front.cost,
            "flank clearance [µm]": front.designs[:, -2],
            "radial clearance [µm]": front.designs[:, -1],
            "knee": ["yes" if at == front.knee else "" for at in range(front.cost.size)],
        }
    )


def clearance_front_table(results: AllocationResults) -> pd.DataFrame:
    """Return the front of cost, peak-to-peak and radial clearance, its knee marked."""
    front = results.fronts.with_clearance
    return pd.DataFrame(
        {
            "cost [cost units]": front.cost,
            "peak-to-peak kept, told [arcsec]": front.quantile,
            "on the kernel [arcsec]": front.on_kernel,
            "radial clearance [µm]": front.further[:, 0],
            "knee": ["yes" if at == front.knee else "" for at in range(front.cost.size)],
        }
    )


def front_table(results: AllocationResults) -> pd.DataFrame:
    """Return the exact front of the local models with its certified bound."""
    front = results.fronts.exact
    return pd.DataFrame(
        {
            "peak-to-peak limit [arcsec]": front.limits,
            "cost [cost units]": front.cost,
            "certified bound [cost units]": front.bound,
        }
    )
