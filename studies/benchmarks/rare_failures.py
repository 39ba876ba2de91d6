"""Rare failures with exact answers: how often the estimate without a caution is off, and how often there is a caution.

Each case of `tests/reliability.py` is asked with full effort and many seeds, from 16,384 random units on:

    python studies/benchmarks/rare_failures.py [--seeds 100] [--case WORD] [--json]

"worst" is the largest factor between an estimate without a caution and the exact answer; "beyond" the share of all
estimates that lie more than three stated standard errors from it.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.reliability import CASES, RareCase, random_units
from tolalloc.capability.yield_at_limit import agreement
from tolalloc.drawings.seeds import SeedTree

UNITS = 16_384
LARGEST_FACTOR, LARGEST_BEYOND, LARGEST_CAUTIONED = 2.0, 0.005, 0.05


def row(case: RareCase, seeds: int) -> dict[str, Any]:
    """Return what so many seeds say of a case."""
    found = [
        agreement(case, random_units(case, SeedTree(seed, ("units",)), UNITS), SeedTree(seed)) for seed in range(seeds)
    ]
    estimates = np.array([item.estimate.probability for item in found])
    errors = np.array([item.estimate.standard_error for item in found])
    cautioned = np.array([bool(item.estimate.cautions) for item in found])
    factors = np.maximum(estimates, case.exact) / np.maximum(np.minimum(estimates, case.exact), np.finfo(float).tiny)
    return {
        "case": case.name,
        "variables": case.variables,
        "benign": case.benign,
        "exact": case.exact,
        "median": float(np.median(estimates)),
        "worst": float(factors[~cautioned].max()) if not cautioned.all() else None,
        "beyond": int((np.abs(estimates - case.exact) > 3 * errors).sum()),
        "cautioned": int(cautioned.sum()),
        "calls": float(np.mean([sum(own.calls for own in item.estimates) for item in found])),
    }


def summary(rows: list[dict[str, Any]], seeds: int) -> dict[str, Any]:
    """Return the figures over all cases."""
    benign = [item["cautioned"] for item in rows if item["benign"]]
    return {
        "cases": len(rows),
        "estimates": seeds * len(rows),
        "worst without a caution": max(item["worst"] or 1.0 for item in rows),
        "share beyond three errors": sum(item["beyond"] for item in rows) / (seeds * len(rows)),
        "share with a caution": sum(item["cautioned"] for item in rows) / (seeds * len(rows)),
        "share with a caution, benign cases": sum(benign) / (seeds * len(benign)) if benign else None,
        "most calls": max(item["calls"] for item in rows),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--seeds", type=int, default=100, help="seeds of each case")
    parser.add_argument("--case", default="", help="part of the names of the cases to ask")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    if asked.seeds < 1:
        parser.error(f"--seeds is {asked.seeds}; allowed is 1 or more.")
    rows = []
    for case in CASES:
        if asked.case in case.name:
            rows.append(row(case, asked.seeds))
            sys.stderr.write(f"\r{len(rows)} of {len(CASES)} cases")
    sys.stderr.write("\n")
    answer = summary(rows, asked.seeds)
    if asked.json:
        print(json.dumps({"cases": rows, "summary": answer}, ensure_ascii=False, indent=2))
        return
    print(f"{'case':46}{'dim':>5}{'exact':>10}{'median':>10}{'worst':>7}{'beyond':>8}{'caution':>9}{'calls':>10}")
    for item in rows:
        worst = "—" if item["worst"] is None else f"{item['worst']:.2f}"
        print(
            f"{item['case'] + ' *' * item['benign']:46}{item['variables']:5}{item['exact']:10.2e}{item['median']:10.2e}"
            f"{worst:>7}{item['beyond'] / asked.seeds:8.1%}{item['cautioned'] / asked.seeds:9.0%}{item['calls']:10,.0f}"
        )
    print("* one region with a smooth limit")
    for name, value in answer.items():
        print(f"{name}: {value:.4g}" if value is not None else f"{name}: none")


if __name__ == "__main__":
    main()
