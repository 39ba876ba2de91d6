"""Sheets that go on calculating: change a zone and see cost, variance and what every requirement then keeps.

The cells hold formulas, so the workbook needs no tolalloc. It says what the local models around the drawing say, no
more: small changes of zones are judged well, large ones by ``tolalloc`` on fresh units.
"""

from __future__ import annotations

from functools import singledispatch

import numpy as np
import pandas as pd
from openpyxl.utils import get_column_letter

from tolalloc.allocation.cost.closed_forms import Combined, Exponential, Reciprocal, ReciprocalPower
from tolalloc.allocation.cost.model import Weighted
from tolalloc.allocation.cost.sampled import Spline, SumOfCosts, Tabulated
from tolalloc.report.allocation.results import AllocationResults
from tolalloc.report.allocation.tables import unit_of
from tolalloc.units import MICROMETRE

_FIRST = 2
"""Row of the first entry below the header."""
_WEIGHTS = 10
"""Column of the first weight."""


@singledispatch
def cost_formula(model: object, zone: str) -> str:
    """Return a cost as a formula of a spreadsheet, without the equals sign.

    Parameters
    ----------
    model
        The cost model.
    zone
        Expression of the zone in the unit of the model.
    """
    raise TypeError(f"{type(model).__name__} has no formula of {zone}")


@cost_formula.register
def _(model: Reciprocal, zone: str) -> str:
    return f"({model.fixed!r}+{model.factor!r}/{zone})"


@cost_formula.register
def _(model: ReciprocalPower, zone: str) -> str:
    return f"({model.fixed!r}+{model.factor!r}/{zone}^{model.exponent!r})"


@cost_formula.register
def _(model: Exponential, zone: str) -> str:
    return f"({model.fixed!r}+{model.factor!r}*EXP(-{zone}/{model.scale!r}))"


@cost_formula.register
def _(model: Combined, zone: str) -> str:
    return f"({model.fixed!r}+{model.factor!r}*EXP(-{zone}/{model.scale!r})/{zone}^{model.exponent!r})"


@cost_formula.register
def _(model: SumOfCosts, zone: str) -> str:
    parts = [cost_formula(own.rescaled(ratio), zone) for own, ratio in zip(model.models, model.ratios, strict=True)]
    return f"({'+'.join(parts)})"


@cost_formula.register
def _(model: Weighted, zone: str) -> str:
    return f"({model.weight!r}*{cost_formula(model.model, zone)})"


@cost_formula.register(Tabulated)
@cost_formula.register(Spline)
def _(model: Tabulated | Spline, zone: str) -> str:
    zones, costs = np.array(model.points.zones), model.points.costs
    lines = [
        f"IF({zone}<={float(end)!r},{cost!r}+{float(after - cost) / float(end - start)!r}*({zone}-{float(start)!r}),"
        for start, end, cost, after in zip(zones[:-1], zones[1:], costs[:-1], costs[1:], strict=True)
    ]
    return f"{''.join(lines)}{costs[-1]!r}{')' * len(lines)}"


def calculator_sheets(results: AllocationResults) -> dict[str, pd.DataFrame]:
    """Return the sheets ``zones`` (to change) and ``requirements`` (to watch)."""
    return {"zones": _zones(results), "requirements": _requirements(results)}


def _zones(results: AllocationResults) -> pd.DataFrame:
    """Return one row per group, with what its zone costs and what it adds to every limited side."""
    space, chosen = results.drawn, results.chosen
    groups = len(space.groups)
    rows = range(_FIRST, _FIRST + groups)
    made = [
        feature.processes[at]
        for feature, at in zip(space.features, space.process_positions(chosen.design), strict=True)
    ]
    table = pd.DataFrame(
        {
            "group": space.groups,
            "zone to change [µm]": space.first_zones * chosen.design[:groups] / MICROMETRE,
            "zone in the tolerance table [µm]": space.first_zones / MICROMETRE,
            "scale [-]": [f"=B{row}/C{row}" for row in rows],
            "smallest [µm]": space.first_zones * [process.minimum for process in made] / MICROMETRE,
            "largest [µm]": space.first_zones * [process.maximum for process in made] / MICROMETRE,
            "inside": [f'=IF(AND(B{row}>=E{row}-0.0001,B{row}<=F{row}+0.0001),"yes","no")' for row in rows],
            "process": chosen.processes,
            "cost [cost units]": [
                f"={cost_formula(process.cost, f'D{row}')}+{process.change!r}"
                for process, row in zip(made, rows, strict=True)
            ],
        }
    )
    for side in chosen.sides:
        table[f"{side.stack.name}: added per scale [{unit_of(side.stack.name)}]"] = side.stack.adding
        table[f"{side.stack.name}: spread per scale [{unit_of(side.stack.name)}]"] = side.stack.spreading
    return table


def _requirements(results: AllocationResults) -> pd.DataFrame:
    """Return one row per limited side with what the zones of the other sheet would keep, and the total cost."""
    space, chosen = results.drawn, results.chosen
    first, last = _FIRST, _FIRST + len(space.groups) - 1
    scales, watched = f"zones!$D${first}:$D${last}", []
    for at, side in enumerate(chosen.sides):
        adds, spreads = (get_column_letter(_WEIGHTS + 2 * at + step) for step in (0, 1))
        load = (
            f"SUMPRODUCT(zones!${adds}${first}:${adds}${last},{scales})"
            f"+SQRT(SUMPRODUCT((zones!${spreads}${first}:${spreads}${last}*{scales})^2))"
        )
        rest = float(side.stack.slopes @ chosen.design[len(space.groups) :]) - side.stack.room
        upper, row = side.sign > 0, _FIRST + at
        watched.append(
            {
                "what": side.stack.name,
                "limit": side.limit,
                "verified on fresh units": side.value,
                "predicted for the zones": f"=B{row}{'+' if upper else '-'}({load}+({rest!r}))",
                "kept": f'=IF(D{row}{"<=" if upper else ">="}B{row},"yes","no")',
            }
        )
    total = f"=SUM(zones!I{first}:I{last})+{space.locked_cost!r}"
    return pd.DataFrame([*watched, {"what": "cost [cost units]", "predicted for the zones": total}])
