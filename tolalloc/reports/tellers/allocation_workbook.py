"""The drawing as sheets that go on calculating: change a zone and see cost and what each limit then keeps.

The cells hold formulas, so the workbook needs no tolalloc. It says what the local models around the drawing say, no
more: small changes of zones are judged well, large ones by ``tolalloc`` on units of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import singledispatch

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.allocation.cost.model import ClosedForm, SumOfCosts, Weighted
from tolalloc.allocation.cost.points import Spline, Tabulated
from tolalloc.allocation.result import AllocationResult
from tolalloc.drawings.sources import LENGTHS, STEPS, Source, length_unit, rounded_down
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.excel import Book, Formula, Sheet, letter
from tolalloc.reports.feature_frame import FINEST, FeatureFrame, writing_unit
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.allocation_answer_sheet import add_answer, linked
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number as signed

_say = Sentences("allocation")

_FIRST = 2
"""Row of the first entry below the header."""
_WEIGHTS = 17
"""Column of the first weight; those before it are printed."""
_NAMES, _LINE = 34, 15.0
"""Letters of a line in the first column [-], and height of a line [pt]."""
_WIDTHS = (_NAMES, 10, 10, 8, 9, 9, 7, 14, 9, 29, 10, 6, 9, 9, 9, 8)
"""Widths of the printed columns, narrow enough for letters of 2 mm on A4 [letters]."""
_HELD = "drawing!$P${}:$P${}"
"""Cells that say of every zone whether the weights hold for it."""
_AS_VERIFIED = 1e-4
"""Distance up to which a zone is the verified one, or at a bound [µm]."""
_INPUT = {"bg_color": "#FFF2CC", "border": 1, "border_color": "#7F7F7F"}
_RESULT = {"bg_color": "#E2EFDA"}
_WRAPPED = {"text_wrap": True, "valign": "top"}


@dataclass(frozen=True)
class _Line:
    """A line of the drawing."""

    name: str
    source: Source  # The member that stands for all
    group: str  # Group whose zone it has, or follows in the ratio of the tolerance table; empty where it is locked


def add_calculator(book: Book, result: AllocationResult, header: Header, notes: Sequence[str]) -> None:
    """Add the sheets ``answer``, ``drawing`` (to change and to print) and ``requirements`` (how the limits follow).

    Parameters
    ----------
    book
        It has no sheet yet.
    result, header
        The allocation, and what is said of its run.
    notes
        What must be said with the zones.
    """
    lines, watched = _lines(result), _requirements(result, header.cost_unit)
    add_answer(book, result, header, watched)
    jointly = (_say("workbook_jointly"),) if result.chosen.jointly else ()
    below = (*notes, *_without_weight(result), *jointly, _say("workbook_change"), _say("workbook_models"))
    sheet = book.table("drawing", _drawing(result, lines, header.cost_unit))
    _mark(result, lines, sheet)
    _below(sheet, watched, len(lines), below)
    _lay_out(sheet, len(_WIDTHS) + 2 * len(result.chosen.alone))
    _add_requirements(book, watched)


def _lines(result: AllocationResult) -> list[_Line]:
    """Return the lines as the sheet has them: one to change of each group, those that follow one, and locked ones."""
    to_change = {
        group: next(own for own in result.dimensions[group] if not own.locked) for group in result.drawn.groups
    }
    changed, following, locked = dict[str, _Line](), list[_Line](), list[_Line]()
    for group, members in result.lines:
        name, first = result.line_name((group, members)), members[0]
        if group in to_change and to_change[group] in members:
            changed[group] = _Line(name, to_change[group], group)
        elif group in to_change and not first.locked:
            following.append(_Line(name, first, group))
        else:
            locked.append(_Line(name, first, ""))
    return [*(changed[group] for group in to_change), *following, *locked]


def _drawing(result: AllocationResult, lines: Sequence[_Line], cost_unit: str) -> pd.DataFrame:
    """Return one row per line: what to write, and of a group what it costs and what it adds to every limited side."""
    space, chosen, reach = result.drawn, result.chosen, result.model_range.factor
    unit, length = length_unit(space.errors.sources)
    near = f"{_AS_VERIFIED * MICROMETRE / length:.12f}".rstrip("0")
    positions, first = space.process_positions(chosen.design), space.first_zones.tolist()

    def stated(line: _Line, written: Formula | float) -> dict[str, object]:
        head, datums = f"write [{writing_unit(result.drawn_sources)}]", _frame(result, line.source).datums
        return {"characteristic": _characteristic(result, line.source), head: written, "datum": " ".join(datums)}

    rows = list[dict[str, object]]()
    for at, (line, scale) in enumerate(zip(lines, chosen.scales.tolist(), strict=False)):
        row, zone, process = _FIRST + at, first[at] * scale / length, space.features[at].processes[positions[at]]
        cost = f"={cost_formula(process.cost, f'D{row}')}+{number(process.change)}"
        rows.append(
            {
                "group": line.name,
                f"zone to change [{unit}]": zone,
                f"zone in the tolerance table [{unit}]": first[at] / length,
                "scale [-]": Formula(f"=B{row}/C{row}", scale),
                f"smallest [{unit}]": first[at] * process.minimum / length,
                f"largest [{unit}]": first[at] * process.maximum / length,
                "inside": Formula(f'=IF(AND(B{row}>=E{row}-{near},B{row}<=F{row}+{near}),"yes","no")', "yes"),
                "process": chosen.processes[at],
                f"cost [{cost_unit}]": Formula(cost, float(process.total(np.array(scale)))),
                **stated(line, _written(result, line.source, row, zone, length)),
                f"verified zone [{unit}]": zone,
                f"weights hold from [{unit}]": zone / reach,
                f"weights hold to [{unit}]": zone * reach,
                "weights hold": Formula(f'=IF(AND(B{row}>=N{row}-{near},B{row}<=O{row}+{near}),"yes","no")', "yes"),
            }
        )
        for side in chosen.alone:
            name, added = side.stack.name, side.stack.worst_case + side.relief
            rows[at][f"{name}: added per scale [{unit_of(name)}]"] = added[at]
            rows[at][f"{name}: spread per scale [{unit_of(name)}]"] = side.stack.root_sum_square[at]
    # The others add nothing to cost and limits.
    for row, line in enumerate(lines[len(rows) :], start=_FIRST + len(rows)):
        own, zone = line.source, line.source.zone / length
        shown: dict[str, object] = {"group": line.name, f"zone to change [{unit}]": zone}
        if line.group:
            at = space.groups.index(line.group)
            ratio = number(own.zone / lines[at].source.zone)
            shown[f"zone to change [{unit}]"] = Formula(f"=B{_FIRST + at}*{ratio}", zone)
            rows.append({**shown, **stated(line, _written(result, own, row, zone, length))})
        else:
            written = (
                rounded_down(_frame(result, own).share * own.zone, FINEST[own.length_name][0])
                / LENGTHS[own.length_name]
            )
            rows.append({**shown, "inside": _say("workbook_locked"), **stated(line, written)})
    return pd.DataFrame(rows)


def _frame(result: AllocationResult, source: Source) -> FeatureFrame:
    return portrait_of(result.model).frame(source)


def _characteristic(result: AllocationResult, source: Source) -> str:
    """Return symbol and name of a characteristic, and the length, radius or middle that its zone belongs to."""
    frame = _frame(result, source)
    unit = source.length_name
    _, _, length = frame.zone.removesuffix(f" {unit}").partition("/") if frame.is_framed else ("", "", "")
    where = (
        f"over {length} {unit}" if length else f"{frame.place.removesuffix(f' {unit}')} {unit}" if frame.place else ""
    )
    if frame.is_deviation and source.middle:
        where = f"about nominal {signed(source.middle / LENGTHS[unit], '+.5f')} {unit}"
    return " ".join(filter(None, (frame.symbol, frame.characteristic, where)))


def _written(result: AllocationResult, source: Source, row: int, zone: float, shown: float) -> Formula:
    """Return what the drawing states of a zone in a row: rounded down to its step, half of it for a size or a tilt.

    The zone is in the unit of the sheet, of that length [m]; what is stated in that of the drawing, mm or in.
    """
    share = _frame(result, source).share
    size = f"B{row}/2" if share < 1 else f"B{row}"
    length, (finest, _) = LENGTHS[source.length_name], FINEST[source.length_name]
    step = number((source.step or finest) / shown)
    if not source.step and shown == MICROMETRE:
        step = number(STEPS[-1][1])
        for end, own in reversed(STEPS[:-1]):
            step = f"IF({size}<{number(end)},{number(own)},{step})"
    if not source.step and not result.model.drawn_amounts.finest:  # three figures, as `FIGURES` has them
        decade = f"10^INT(LOG10(MAX({size},1E-9)))"
        step = f"({decade}*IF({size}<2*{decade},0.005,0.01))"
    half = share * zone
    # What was verified is stated as it is, a grade or a smallest zone too.
    value, near = rounded_down(half * shown, finest) / length, _AS_VERIFIED * MICROMETRE / shown
    verified = f"AND({size}>{number(half - near)},{size}<{number(half + near)})"
    found = f"INT({size}/{step}+0.000001)*{step}" + (f"/{length / shown:.0f}" if length != shown else "")
    return Formula(f"=IF({verified},{number(round(value, 8))},{found})", value)


def _without_weight(result: AllocationResult) -> tuple[str, ...]:
    """Return of which zones these sheets know hardly more than that a smaller one gains nothing."""
    weights = np.sum([side.stack.worst_case + side.stack.root_sum_square for side in result.chosen.alone], axis=0)
    names = [group for group, weight in zip(result.drawn.groups, weights.tolist(), strict=True) if weight == 0.0]
    return (_say("workbook_weightless", groups=", ".join(names)),) if names else ()


def _requirements(result: AllocationResult, cost_unit: str) -> pd.DataFrame:
    """Return one row per limited side with what the zones of the other sheet would keep, and the total cost."""
    space, chosen = result.drawn, result.chosen
    first, last = _FIRST, _FIRST + len(space.groups) - 1
    scales, watched = f"drawing!$D${first}:$D${last}", []
    left, ask = f'COUNTIF({_HELD.format(first, last)},"no")', _say("workbook_ask")
    for at, side in enumerate(chosen.alone):
        adds, spreads = (letter(_WEIGHTS + 2 * at + step) for step in (0, 1))
        load = (
            f"SUMPRODUCT(drawing!${adds}${first}:${adds}${last},{scales})"
            f"+SQRT(SUMPRODUCT((drawing!${spreads}${first}:${spreads}${last}*{scales})^2))"
        )
        rest = float(side.stack.slopes @ chosen.design[len(space.groups) :]) - side.stack.budget
        rest -= float(side.relief @ chosen.scales)
        upper, row = side.sign > 0, _FIRST + at
        predicted = float(side.limit + side.sign * side.predicted(chosen.design))
        kept = "yes" if side.sign * predicted <= side.sign * side.limit else "no"
        watched.append(
            {
                "what": side.stack.name,
                "limit": side.limit,
                "independent verification sample": side.value,
                "predicted for the zones": Formula(
                    f"=B{row}{'+' if upper else '-'}({load}+({number(rest)}))", predicted
                ),
                "kept by the model": Formula(
                    f'=IF({left}>0,"{ask}",IF(D{row}{"<=" if upper else ">="}B{row},"yes","no"))', kept
                ),
            }
        )
    total = Formula(f"=SUM(drawing!I{first}:I{last})+{number(space.locked_cost)}", chosen.cost)
    return pd.DataFrame([*watched, {"what": f"cost [{cost_unit}]", "predicted for the zones": total}])


def _lay_out(drawing: Sheet, columns: int) -> None:
    """Set heights and widths of the drawing, and what of it is printed."""
    drawing.height(1, 4 * _LINE)
    for column in range(1, columns + 1):
        drawing.width(column, _WIDTHS[column - 1] if column < _WEIGHTS else 16)
    drawing.inner.freeze_panes(1, 2)
    drawing.print_only(_WEIGHTS - 1)


def _add_requirements(book: Book, watched: pd.DataFrame) -> None:
    """Add the table of what the zones would keep, its results marked."""
    sheet = book.table("requirements", watched)
    for row in range(_FIRST, sheet.rows + 1):
        is_fine = _is_in_inches(watched["what"].iloc[row - _FIRST])
        sheet.cell(row, 4, num_format="0.000000" if is_fine else "0.000", **_RESULT)
    sheet.width(1, _NAMES)
    for column in range(2, watched.shape[1] + 1):
        sheet.width(column, 16)  # a formula is longer than its number
    sheet.height(1, 4 * _LINE)
    sheet.print_only(5)


def _mark(result: AllocationResult, lines: Sequence[_Line], drawing: Sheet) -> None:
    """Mark and guard the zones to change, and show what to write as a drawing does."""
    groups = len(result.drawn.groups)
    guard = {
        "validate": "decimal",
        "criteria": "between",
        "minimum": f"=$E{_FIRST}",
        "maximum": f"=$F{_FIRST}",
        "ignore_blank": False,
        "error_title": "zone",
        "error_message": _say("workbook_guard"),
    }
    drawing.inner.data_validation(f"B{_FIRST}:B{_FIRST + groups - 1}", guard)
    for row, line in enumerate(lines, start=_FIRST):
        drawing.cell(row, 1, **_WRAPPED)
        drawing.height(row, _LINE * (1 + len(line.name) // _NAMES))
        drawing.cell(row, 11, num_format=_written_as(_frame(result, line.source)))
        if row < _FIRST + groups:
            drawing.cell(row, 2, **_INPUT)
            drawing.cell(row, 4, num_format="0.000")


def _written_as(frame: FeatureFrame) -> str:
    """Return the format of a number that looks as on the drawing, whatever the language of its reader."""
    sign = "±" if frame.is_deviation else "⌀" if frame.zone.startswith("⌀") else ""
    number = '0.00000#" in"' if frame.zone.endswith(" in") else "0.0000#"
    return f'"{sign}"{number}' if sign else number


def _below(drawing: Sheet, watched: pd.DataFrame, rows: int, notes: tuple[str, ...]) -> None:
    """Write cost, limits and notes below the drawing."""
    start = _FIRST + rows + 1
    for column, header in enumerate(("what", "limit", "predicted", "kept"), start=1):
        drawing.cell(start, column, header, bold=True)
    for at, own in enumerate(watched.to_dict("records")):
        row = start + 1 + at
        drawing.cell(row, 1, str(own["what"]), **_WRAPPED)
        drawing.height(row, _LINE * (1 + len(str(own["what"])) // _NAMES))
        shown_as = "0.000000" if _is_in_inches(own["what"]) else "0.00"
        for column, place in enumerate("BDE", start=2):
            shown = linked(watched, at, place)
            if not pd.isna(shown.value):
                drawing.cell(row, column, shown, num_format=shown_as, **_RESULT)
    for row, text in enumerate(notes, start=drawing.rows + 2):
        drawing.cell(row, 1, text, italic=True)


def _is_in_inches(what: object) -> bool:
    """Return whether what is watched is an output in inches, whose limits need more decimals."""
    return str(what).split(",")[0].endswith("[in]")


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
def _(model: ClosedForm, zone: str) -> str:
    given = {field.name: number(getattr(model, field.name)) for field in fields(model)}
    falling = f"*EXP(-{zone}/{given['scale']})" if "scale" in given else ""
    power = f"/{zone}^{given['exponent']}" if "exponent" in given else "" if falling else f"/{zone}"
    return f"({given['fixed']}+{given['factor']}{falling}{power})"


@cost_formula.register
def _(model: SumOfCosts, zone: str) -> str:
    parts = [cost_formula(own.rescaled(ratio), zone) for own, ratio in zip(model.models, model.ratios, strict=True)]
    return f"({'+'.join(parts)})"


@cost_formula.register
def _(model: Weighted, zone: str) -> str:
    return f"({number(model.weight)}*{cost_formula(model.model, zone)})"


@cost_formula.register
def _(model: Tabulated, zone: str) -> str:
    zones, slopes = np.array(model.points.zones), np.diff(model.points.costs) / np.diff(model.points.zones)
    return _piecewise(zone, model.points.costs[0], slopes[0], zones[:-1], np.diff(slopes, prepend=slopes[0])[:, None])


@cost_formula.register
def _(model: Spline, zone: str) -> str:
    zones, costs = np.array(model.points.zones), np.array(model.points.costs)
    slopes, lengths = model.slope(zones), np.diff(zones)
    secants, ends = np.diff(costs) / lengths, slopes[:-1] + slopes[1:]
    # Square and cubic coefficients of every piece, none before the first point and behind the last.
    square = np.concatenate([[0.0], (3 * secants - slopes[:-1] - ends) / lengths, [0.0]])
    cubic = np.concatenate([[0.0], (ends - 2 * secants) / lengths**2, [0.0]])
    bent = np.diff(square) - 3 * cubic[:-1] * np.concatenate([[0.0], lengths])
    return _piecewise(zone, costs[0], slopes[0], zones, np.stack([np.zeros(zones.size), bent, np.diff(cubic)], axis=1))


def _piecewise(
    zone: str,
    cost: float,
    slope: float,
    zones: Float[np.ndarray, " point"],
    changes: Float[np.ndarray, "point power"],
) -> str:
    """Return a line that gets terms of first, second, … power behind every point: no IF in an IF, however many."""
    terms = [
        f"{number(change)}*MAX({zone}-{number(point)},0)^{power}"
        for point, own in zip(zones, changes, strict=True)
        for power, change in enumerate(own, start=1)
        if change
    ]
    return f"({'+'.join([number(cost), f'{number(slope)}*({zone}-{number(zones[0])})', *terms])})"


def number(value: float) -> str:
    """Return a number with all its digits, as a workbook stores it whatever the language of its reader."""
    return repr(float(value)).upper()
