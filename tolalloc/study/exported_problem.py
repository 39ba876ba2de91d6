"""A study as files that another tolerance program, or a script, can read and be compared with."""

from __future__ import annotations

import csv
import inspect
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import numpy as np

from tolalloc.capability.linear_function import LinearFunction
from tolalloc.capability.monte_carlo import KeptLimits
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import is_angular
from tolalloc.drawings.tolerance_table import table_text
from tolalloc.models.function_model import BoundFunction
from tolalloc.reading.units import COST_UNITS, MICROMETRE
from tolalloc.reports.folder import RUNS, claimed, numbered
from tolalloc.reports.writer import write_json
from tolalloc.running.progress import Progress
from tolalloc.study.commands import finished_run
from tolalloc.study.prepared import Prepared
from tolalloc.study.study import Study

_READ_ME = """# {name}

A tolerance problem for any program. Model: {model}.

| file | holds |
|---|---|
| `tolerances.csv` | the tolerance table: zones, their ranges and costs |
| `limits.csv` | limits of each output, and what must be shown of it |
| `settings.csv` | what may be chosen beside the zones, and its value in `points.csv` |
{nominals}{ways}| `points.csv` | random assemblies of today's drawing: deviations, outputs, `status` (0: an answer) |
{formulas}| `expected.json` | the answers of tolalloc |

1. The share of rows of `points.csv` within all limits is the yield of today's drawing; no answer counts as outside.
   {said}
2. A program without this model fits one to the rows, or takes a formula where there is one.
3. The cheapest drawing keeps every limit as `limits.csv` asks{joint}.
   `expected.json` holds its cost and yield where a run of this study at its full effort stands in the folder `runs`.

How to read them: `plus` and `minus` are deviations from the nominal size, `min` and `max` the smallest and largest
whole zone. A normal size has σ = zone/(6·Cp) about the middle of its zone, of a position on each of two axes so that
99.73 % of its parts lie inside at Cp 1. A line of zone t costs cost·zone/t, or what its processes cost.
{missing}

Row to post: program and version; yield of today's drawing; cost of the cheapest drawing; its yield; time taken.
"""
_LINEAR = "| `linear.csv` | outputs that are linear: a constant, then the factor of each deviation |\n"
_NOMINALS = "| `nominals.csv` | nominal size of each argument of the function, to which its deviation is added |\n"
_WAYS = "| `costs.csv` | what each process of a line, or of its group, costs from its smallest to its largest zone |\n"
_SOURCE = "| `model.py` | the file of the model's function, as it stands |\n"
_ZONES = 41
"""Zones at which the cost of a process is written, in equal ratios [-]."""
_SAID = (
    "Expected is {0.estimate:.4f} ({0.low:.4f} to {0.high:.4f}, 95 % interval), of {0.units:,} other random assemblies."
)


def export_problem(study: Study, folder: Path, points: int, progress: Progress) -> str:
    """Write a new or empty folder, and say the yield of today's drawing, of as many other random units."""
    prepared = Prepared(study=study)
    errors, limits = prepared.errors, {own.output: own.limits for own in prepared.requirements}
    response, seeds = prepared.model.reading(tuple(limits)), SeedTree(study.seed).child("export")
    x, others = (errors.random_units(points, seeds.child(name)) for name in ("points", "yield"))
    with claimed(folder) as beside:
        progress.begin("random units", 2 * points)
        found = response(x)
        progress.advance(points)
        kept = KeptLimits.of(response(others), tuple(limits), limits)
        (beside / "tolerances.csv").write_text(table_text(errors.sources, None, prepared.currency), encoding="utf-8")
        asked = (
            (own.output, own.limits.lower, own.limits.upper, own.guarantee.words, getattr(own.guarantee, "target", ""))
            for own in prepared.requirements
        )
        _write(beside / "limits.csv", ("output", "lower", "upper", "to be shown", "target [-]"), asked)
        chosen = ((own.name, own.value, own.lower, own.upper) for own in prepared.model.settings)
        _write(beside / "settings.csv", ("setting", "value", "lower", "upper"), chosen)
        named = zip(errors.columns, errors.source_of_column, strict=True)
        heads = [f"{name} [{'µrad' if is_angular(source) else 'µm'}]" for name, source in named]
        rows = np.column_stack([x / MICROMETRE, found.known, found.status]).tolist()
        _write(beside / "points.csv", (*heads, *limits, "status"), rows)
        formulas = ""
        if planes := LinearFunction.through_each(x, dict(zip(limits, found.known.T, strict=True))):
            factors = ((name, own.offset, *(own.slopes * MICROMETRE).tolist()) for name, own in planes.items())
            _write(beside / "linear.csv", ("output", "constant", *heads), factors)
            formulas = _LINEAR
        formulas += _source(prepared, beside)
        runs = (finished_run(study, place) for place in reversed(numbered(RUNS / study.name)))
        yields, cost = {**kept.each, "all limits": kept.joint}, float(prepared.space.cost(prepared.space.uniform(1.0)))
        expected = {
            f"yield of today's drawing with its 95 % interval, {points} units [-]": {
                name: (own.estimate, own.low, own.high) for name, own in yields.items()
            },
            f"cost of today's drawing [{prepared.currency or COST_UNITS}]": cost,
            "allocation": next((run.summary for run in runs if run and run.allocates), None),
        }
        write_json(expected, beside / "expected.json")
        said = _SAID.format(kept.joint)
        joint = f", and {prepared.joint.target:.6g} of all units keep all of them at once" if prepared.joint else ""
        text = _READ_ME.format(
            name=study.name,
            model=prepared.model.name,
            nominals=_nominals(prepared, beside),
            ways=_ways(prepared, beside),
            formulas=formulas,
            said=said,
            joint=joint,
            missing=_missing(prepared),
        )
        (beside / "README.md").write_text(text, encoding="utf-8")
    return said


def _nominals(prepared: Prepared, folder: Path) -> str:
    """Write the nominal sizes of a function's arguments and return their row of the page."""
    model = prepared.model
    if not isinstance(model, BoundFunction):
        return ""
    rows = zip(model.source.inputs, (model.offsets / model.lengths).tolist(), strict=True)
    _write(folder / "nominals.csv", ("argument", "nominal, in the unit of the function"), rows)
    return _NOMINALS


def _ways(prepared: Prepared, folder: Path) -> str:
    """Write what processes cost where a table of them is given, and return their row of the page."""
    space, drawing = prepared.space, prepared.study.drawing
    if not (drawing and drawing.costs):
        return ""
    rows = [
        (group, own.name, first * scale / MICROMETRE, float(own.total(np.array(scale))))
        for group, feature, first in zip(space.groups, space.features, space.first_zones.tolist(), strict=True)
        for own in feature.processes
        for scale in np.geomspace(own.minimum, own.maximum, _ZONES).tolist()
    ]
    head = ("line or group", "process", "zone [µm]", f"cost [{prepared.currency or COST_UNITS}]")
    _write(folder / "costs.csv", head, rows)
    return _WAYS


def _missing(prepared: Prepared) -> str:
    """Return what decides the answer and stands in none of the files."""
    errors = prepared.errors
    found = {
        "correlations between lines": any(len(block) > 1 for block in errors.blocks),
        "deviations of measured parts": any(own.measured for own in errors.active),
        "parts chosen at assembly and what choosing costs": bool(prepared.study.compensators),
    }
    missing = [what for what, is_there in found.items() if is_there]
    return f"\nNot in these files: {'; '.join(missing)}. `points.csv` follows them.\n" if missing else ""


def _source(prepared: Prepared, folder: Path) -> str:
    """Write the file of a function and return its row of the page; what was typed into a session stands in none."""
    if isinstance(prepared.model, BoundFunction):
        with suppress(OSError, TypeError):
            text = Path(inspect.getfile(prepared.model.source.function)).read_text(encoding="utf-8")
            (folder / "model.py").write_text(text, encoding="utf-8")
            return _SOURCE
    return ""


def _write(path: Path, head: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])
