"""Quality of the allocation on random reducers and tables, against searches on the same model and what a table costs.

    python studies/benchmarks/allocation_quality.py [--studies 30] [--effort quick] [--calls-factor 10] [--budget 60]

Every study of `tests/random_studies.py` (2–4 cranks, 1–3 discs, groups, locked rows, processes, grades, one to four
limits) is solved by the package, by pymoo's NSGA-II and CMA-ES with so many times the units that the package solved, or
until their budget of processor time is spent, by proportional scaling, and by the table as it is.

All designs are compared on the same fresh units. Free zones are scaled alike, the package's too, until these units just
keep the limits, so that neither a margin nor luck counts. Designs on grades cannot be; there a rival is cheaper if it
costs less and lies inside the limits or no farther beyond than the package's design. The ten cheapest designs on grades
that a rival's own units found inside the limits are tried on the fresh units until one keeps them, which is to the
rival's advantage. Solved studies are kept in the folder and not solved again. The exit code is 1 if a verified design
of a report costs less than a bound printed there.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

sys.path.insert(0, str(Path(__file__).parents[2]))

from allocation_rivals import SEARCH_UNITS, Compared, Rival

from tests.random_cases import random_study
from tolalloc.allocation.result import AllocationResult
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

TRIED = 10
ROUNDING = 1e-9
TOLD_APART = 1e-3
"""Difference of two costs of free zones that settling them at the limits tells apart, relative [-]."""
ALGORITHMS = ("NSGA-II", "CMA-ES")
RIVALS = ("table", "proportional", *ALGORITHMS)


def undercut(answer: AllocationResult) -> bool:
    """Return whether a verified design of a report costs less than a bound printed there.

    What fresh units judged after its search, and did not confirm, is not verified.
    """
    tried = (*answer.free.tried, *(answer.graded.tried if answer.graded else ()))
    refused = [own.design for own in tried if own.independent is not None and not own.met]
    found = [(answer.bound, own) for own in answer.candidates.admitted().values()]
    found += [(answer.free.bound, own) for own in answer.free.tried]
    if answer.graded:
        found += [(answer.graded.bound, own) for own in answer.graded.tried[1:]]
    return any(
        bound is not None
        and own.met
        and own.cost < bound * (1 - ROUNDING)
        and not any(np.array_equal(own.design, design) for design in refused)
        for bound, own in found
    )


def judged(
    compared: Compared, space: DesignSpace, design: Float[np.ndarray, " variable"], graded: bool, bounded: bool = True
) -> dict[str, float]:
    """Return cost and excess of a design on the fresh units, free zones scaled alike until it just keeps the limits."""
    found, excess = (design, compared.excess(space, design)) if graded else compared.settled(space, design, bounded)
    return {"cost": float(space.cost(found)), "excess": excess}


def rival(
    algorithm: str, prepared: Prepared, compared: Compared, graded: bool, calls: int, budget: float
) -> dict[str, float]:
    """Return what a search found, on the fresh units, and what it took."""
    seeds, start = compared.seeds.child(algorithm), time.process_time()
    search = Rival(
        compared=Compared(prepared=prepared, seeds=seeds, units=SEARCH_UNITS),
        graded=graded,
        calls=calls,
        seconds=budget,
    )
    asked = search.search(algorithm, seeds.integer())
    seconds = time.process_time() - start
    inside = sorted((own for own in asked if own[1] <= 0), key=lambda own: own[0])
    chosen = inside[: TRIED if graded else 1] or sorted(asked, key=lambda own: own[1])[:1]
    tried = list[dict[str, float]]()
    for own in chosen:  # the cheapest one first
        tried.append(judged(compared, search.space, own[2], graded))
        if tried[-1]["excess"] <= 0:
            break
    best = min(tried, key=lambda own: own["excess"])
    return {**best, "seconds": seconds, "calls": len(asked) * SEARCH_UNITS}


def row(number: int, asked: argparse.Namespace) -> dict[str, Any]:
    """Return what everybody found for one study."""
    study, start = random_study(number), time.process_time()
    told = study.allocate(effort=asked.effort)
    answer = told.result
    seconds, graded = time.process_time() - start, answer.graded is not None
    prepared = Prepared(study=study)
    compared = Compared(prepared=prepared, seeds=SeedTree(study.seed).child("quality"), units=asked.units)
    calls, chosen, free = sum(told.header.statuses.values()), answer.chosen, answer.free
    found = {"package": judged(compared, chosen.space, chosen.design, graded)}
    found["package"] |= {"seconds": seconds, "calls": calls}
    table, alike = free.baseline, free.proportional
    found["table"] = judged(compared, table.space, table.design, graded=True)
    found["proportional"] = judged(compared, alike.space, alike.design, graded, bounded=False)
    for algorithm in ALGORITHMS:
        found[algorithm] = rival(algorithm, prepared, compared, graded, int(asked.calls_factor * calls), asked.budget)
    return {
        "study": number,
        "cranks": study.model.reducer.crank_count,
        "discs": study.model.reducer.disc_count,
        "groups": len(prepared.space.groups),
        "limits": len(prepared.requirements),
        "graded": graded,
        "processes": prepared.space.has_choices,
        "met": answer.met,
        "cost": answer.cost,
        "bound": answer.bound,
        "undercut": undercut(answer),
        "cheaper": cheaper(found, graded),
        **{f"{name}, {what}": value for name, own in found.items() for what, value in own.items()},
    }


def cheaper(found: dict[str, dict[str, float]], graded: bool) -> list[str]:
    """Return the rivals that keep the limits at less cost than the package.

    On grades scaled zones are no rivals, as a drawing may not carry them.
    """
    own, allowed = found["package"], max(0.0, found["package"]["excess"])
    told_apart = ROUNDING if graded else TOLD_APART
    names = [name for name in RIVALS if not (graded and name == "proportional")]
    return [
        name
        for name in names
        if found[name]["excess"] <= allowed and found[name]["cost"] < own["cost"] * (1 - told_apart)
    ]


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures over all studies."""
    gaps = {
        name: [
            own["cost"] / own["bound"] - 1 for own in rows if own["bound"] and own["met"] and own["graded"] is graded
        ]
        for name, graded in (("free", False), ("grades", True))
    }
    return {
        "studies": len(rows),
        "never dearer": sum(not own["cheaper"] for own in rows),
        "met": sum(own["met"] for own in rows),
        "verified designs below a printed bound": sum(own["undercut"] for own in rows),
        **{f"median gap, {name} [%]": 100 * float(np.median(own)) if own else None for name, own in gaps.items()},
        "median processor time [s]": float(np.median([own["package, seconds"] for own in rows])),
    }


def measure(asked: argparse.Namespace) -> list[dict[str, Any]]:
    """Return the rows of all studies, those that are kept as they are."""
    asked.folder.mkdir(parents=True, exist_ok=True)
    settings, rows = f"{asked.effort}-{asked.calls_factor:g}-{asked.budget:g}-{asked.units}", []
    for number in range(asked.first, asked.first + asked.studies):
        kept = asked.folder / f"{settings}-{number}.json"
        if not kept.exists():
            found = row(number, asked)
            beside = kept.with_suffix(".unfinished")
            beside.write_text(json.dumps(found, indent=2, ensure_ascii=False), encoding="utf-8")
            beside.replace(kept)
        rows.append(json.loads(kept.read_text(encoding="utf-8")))
        sys.stderr.write(f"\r{len(rows)} of {asked.studies} studies")
    sys.stderr.write("\n")
    with (asked.folder / f"{settings}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(own | {"cheaper": ", ".join(own["cheaper"])} for own in rows)
    return rows


def printed(rows: list[dict[str, Any]]) -> str:
    """Return the table for people; a cost in brackets does not keep the limits on the fresh units."""
    lines = [
        f"{'':3}{'cranks':>7}{'discs':>6}{'groups':>7}{'limits':>7} {'zones':<7}{'met':>4}{'cost':>8}{'bound':>8}"
        + "".join(f"{name:>14}" for name in ("package", *RIVALS))
        + f"{'CPU s':>8}"
    ]
    for own in rows:
        costs = [(own[f"{name}, cost"], own[f"{name}, excess"]) for name in ("package", *RIVALS)]
        lines.append(
            f"{own['study']:<3}{own['cranks']:7}{own['discs']:6}{own['groups']:7}{own['limits']:7} "
            f"{'grades' if own['graded'] else 'free':<7}{'yes' if own['met'] else 'no':>4}{own['cost']:8.2f}"
            + (f"{own['bound']:8.2f}" if own["bound"] else f"{'—':>8}")
            + "".join(f"{f'{cost:.2f}' if excess <= 0 else f'({cost:.2f})':>14}" for cost, excess in costs)
            + f"{own['package, seconds']:8.1f}"
            + (f"  cheaper: {', '.join(own['cheaper'])}" if own["cheaper"] else "")
        )
    return "\n".join(lines)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--studies", type=int, default=30, help="number of random studies")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--effort", choices=("quick", "full"), default="quick", help="effort of the package")
    parser.add_argument("--calls-factor", type=float, default=10.0, help="units of a rival over those of the package")
    parser.add_argument("--budget", type=float, default=60.0, help="processor time of a rival [s]")
    parser.add_argument("--units", type=int, default=2048, help="fresh units on which all designs are compared")
    parser.add_argument("--folder", type=Path, default=Path("runs/allocation_quality"), help="where studies are kept")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    if min(asked.studies, asked.calls_factor, asked.budget) <= 0 or asked.first < 0 or asked.units < 500:
        parser.error("--studies, --calls-factor and --budget must be above 0, --first 0 or more, --units 500 or more.")
    rows = measure(asked)
    found = summary(rows)
    if asked.json:
        print(json.dumps({"studies": rows, "summary": found}, ensure_ascii=False, indent=2))
    else:
        print(printed(rows))
        print(f"never dearer: {found['never dearer']} of {found['studies']}")
        for name, value in found.items():
            print(f"{name}: {value:.4g}" if value is not None else f"{name}: none")
    return 1 if found["verified designs below a printed bound"] else 0


if __name__ == "__main__":
    sys.exit(main())
