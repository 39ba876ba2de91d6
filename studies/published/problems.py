"""Ten published tolerance problems as files for any tolerance program.

python -m studies.published.problems FOLDER

Each is a folder as `tolalloc export-problem` writes it, with `published.json` beside it: what the source prints. Where
a source prints limits but no costs, every line costs 1 at its printed zone, falling as 1/zone, and the limits are the
printed root sum square; both are assumed here.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tolalloc as ta
from studies.choi2000_clutch import study as clutch
from tolalloc.reports.writer import write_json
from tolalloc.running.progress import SILENT, Progress
from tolalloc.study.exported_problem import export_problem

from .allocation_cases import CASES, limit_stack

_EXPONENTIAL = Path(__file__).with_name("gap_chain.process_costs.csv")
_BATCHES = "0.6:-0.3:0.03 0.4:0.4:0.03"
"""Parts at −0.03 and 0.04 mm of a zone of ± 0.1 mm, each spread by σ = 1 µm."""


def stack(name: str, slopes: Mapping[str, float], rows: Sequence[dict[str, Any]], unit: str, **more: Any) -> ta.Study:
    """Return the study of a sum of sizes, each times its slope; its limits, processes and questions are given."""

    def total(*sizes: Any) -> Any:
        return sum(slope * size for slope, size in zip(slopes.values(), sizes, strict=True))

    output, costs = f"gap [{unit}]", more.get("costs", "")
    priced = [{"unit": unit, "cost": 1.0, "min": 0.0002, **row} for row in rows]
    drawing = ta.Drawing.of_rows(priced, place=name, costs=costs)
    model = ta.model(total, inputs={row["id"]: row["nominal"] for row in rows}, outputs=(output,), name=name)
    asked = [ta.Allocation(front=False, what_if=False)]
    return ta.Study(model, drawing, limits={output: more["limit"]}, questions=asked, name=name, seed=1)


def gap_chain(variant: str) -> ta.Study:
    """Return a variant of the gap of three parts; t of its costs is half of a zone [mm]."""
    case = CASES["gap_chain"]
    cost, (lower, upper), names = case["cost"], case["requirement"]["limits"], ("x1", "x2", "x3")
    least, most = dict.fromkeys(names, cost["t_min"]), dict.fromkeys(names, cost["t_max"])
    least |= {"x1": 0.25} if variant == "t_min of x1 is 0.25" else {}
    most |= {"x3": 0.30} if variant == "t_max of x3 is 0.30" else {}
    ways = {name: [("only", 1, factor, least[name], most[name])] for name, factor in zip(names, cost["b"], strict=True)}
    rows = [
        {"id": name, "nominal": size, "plus": 0.3, "minus": -0.3, "min": 2 * least[name], "max": 2 * most[name]}
        for name, size in zip(names, case["nominal"], strict=True)
    ]
    costs = _EXPONENTIAL if variant == "exponential" else ways
    limit = ta.Limit(lower=lower, upper=upper, show=ta.AtYield(target=case["requirement"]["yield"]))
    slopes = dict(zip(names, case["sensitivities"], strict=True))
    return stack(f"gap_chain_{variant.replace(' ', '_')}", slopes, rows, "mm", costs=costs, limit=limit)


def bearing_stack() -> ta.Study:
    """Return the shaft stack of normal, evenly spread and twofold parts."""
    case = CASES["bearing_stack"]
    laws = {"uniform": {"distribution": "uniform"}, "two points": {"distribution": "mixture", "batches": _BATCHES}}
    rows, slopes = [], dict[str, float]()
    for own in case["contributors"]:
        name, width = own["name"].replace(" ", "_"), own["plus"] - own["minus"]
        size = {key: own[key] for key in ("nominal", "plus", "minus")}
        rows.append({"id": name, **size, "max": 2 * width, **laws.get(own["distribution"], {})})
        slopes[name] = own["sign"]
    lower, upper = case["limits"]
    return stack("bearing_stack", slopes, rows, "mm", limit=ta.Limit(lower=lower, upper=upper))


def signed_stack(name: str, rows: Sequence[Sequence[float]], unit: str, reach: float) -> ta.Study:
    """Return the stack of rows of signed size, plus and minus, at most as far from its middle as its limits."""
    middle, signs, _ = limit_stack(rows)
    parts = [
        {"id": f"d{at}", "nominal": abs(size), "plus": plus, "minus": minus, "max": 4 * (plus - minus)}
        for at, (size, plus, minus) in enumerate(rows, start=1)
    ]
    slopes = dict(zip((part["id"] for part in parts), signs.tolist(), strict=True))
    limit = ta.Limit(lower=middle - reach, upper=middle + reach, show=ta.RootSumSquare())
    return stack(name, slopes, parts, unit, limit=limit)


def chapter_12() -> ta.Study:
    """Return the two-dimensional stack with the sensitivities that its book prints [in]."""
    case = CASES["handbook_1999"]["chapter 12"]
    rows, slopes = [], dict[str, float]()
    for at, (size, half, slope) in enumerate(case["rows"], start=1):
        rows.append({"id": f"d{at}", "nominal": size, "plus": half, "minus": -half, "max": 8 * half})
        slopes[f"d{at}"] = slope
    middle, reach = case["computed"]["nominal"], case["computed"]["RSS"]
    limit = ta.Limit(lower=middle - reach, upper=middle + reach, show=ta.RootSumSquare())
    return stack("handbook_1999_chapter_12", slopes, rows, "in", limit=limit)


def problems() -> dict[str, tuple[ta.Study, Any]]:
    """Return the ten: name → study, and what is printed or known in closed form."""
    chain = CASES["gap_chain"]["computed"]
    found: dict[str, tuple[ta.Study, Any]] = {"choi2000_clutch": (clutch, CASES["clutch_choi2000"]["results"]["0"])}
    found |= {
        own.name: (own, chain[variant]) for variant in chain if variant != "sigma_max" for own in [gap_chain(variant)]
    }
    bearing, nine, shaft = CASES["bearing_stack"], CASES["handbook_1999"]["chapter 9"], CASES["mitcalc_stack"]
    for own, printed in (
        (bearing_stack(), bearing["published"]),
        (signed_stack("handbook_1999_chapter_9", nine["rows"], "in", nine["published"]["RSS"]), nine["published"]),
        (chapter_12(), CASES["handbook_1999"]["chapter 12"]["published"]),
        (signed_stack("mitcalc_shaft", shaft["rows"], "mm", shaft["published"]["RSS"]), shaft["published"]),
        (
            signed_stack("gap_of_unequal_limits", [[10, 0.05, -0.05], [-9.8, 0.03, -0.02]], "mm", 0.056),
            {"nominal": 0.2, "worst case": [0.12, 0.27], "root sum square": [0.142, 0.254]},
        ),
    ):
        found[own.name] = own, printed
    return found


def export(folder: Path, points: int = 2000, progress: Progress = SILENT) -> None:
    """Write the ten folders into a new or empty one."""
    for name, (study, printed) in problems().items():
        print(f"{name}: {export_problem(study, folder / name, points, progress)}")
        write_json({"published": printed}, folder / name / "published.json")


if __name__ == "__main__":
    export(Path(sys.argv[1]))
