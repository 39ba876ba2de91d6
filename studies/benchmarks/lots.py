"""How often `ta.lot` names a process that moved, and how often one that did not.

    python studies/benchmarks/lots.py

Lots of 25 parts of the shipped drawing, a gauge reading of every source, at the stated false-alarm rate of 5 % over
all of them. Of a lot with a moved process a source is drawn at random: of a size the mean moves by so many σ of its
process, all readings of a radius or total deviation grow by a factor.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import binom

import tolalloc as ta
from tolalloc.wings.bench.lots import GaugedColumn, LotRequest, LotResult, drawn_lot, judge_lot
from tolalloc.wings.bench.processes import Gauge, Lots

LEVEL = 0.05
SHIFTS, FACTORS = (0.8, 1.0, 1.1, 1.25, 1.5), (1.4, 1.5, 1.6, 1.8, 2.0)


def judged(columns: Sequence[GaugedColumn], drawing: ta.Drawing, lots: Lots) -> LotResult:
    """Return what the readings of one lot show."""
    request = LotRequest(
        path=Path("lot.csv"), drawing=drawing, columns=tuple(columns), level=LEVEL, next_parts=None, seed=1
    )
    return judge_lot(request, lots)


def moved(column: GaugedColumn, shift: float, factor: float) -> GaugedColumn:
    """Return the readings of a process that moved: a size by a shift over σ, anything else by a factor."""
    if column.gauge is Gauge.DEVIATION:
        return replace(column, values=column.values + shift * column.source.zone / 6)
    return replace(column, values=column.values * factor)


def main() -> None:
    """Print false alarms, and of every size of a move how often it was named."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--lots", type=int, default=200)
    parser.add_argument("--parts", type=int, default=25)
    given = parser.parse_args()
    drawing = ta.drawing("rv20e_drawing")
    sources = drawing.errors.active
    lots, rng, start = Lots(2 * len(sources), LEVEL, 1), np.random.default_rng(1), time.perf_counter()
    found = [judged(drawn_lot(sources, given.parts, rng), drawing, lots) for _ in range(given.lots)]
    alarms, took = sum(bool(own.moved) for own in found), time.perf_counter() - start
    print(
        f"{given.lots} lots of {given.parts} parts, {len(sources)} sources, {lots.count:,} simulated lots of a process,"
        f" {1e3 * took / given.lots:.0f} ms a lot: {alarms} with a false alarm; as many or more of {LEVEL:.0%} with "
        f"probability {binom.sf(alarms - 1, given.lots, LEVEL):.2f}; a shift of {found[0].detectable:.2f} σ is to be "
        "found with 95 %"
    )
    for shift, factor in zip(SHIFTS, FACTORS, strict=True):
        named = {gauge: [0, 0] for gauge in Gauge}
        for _ in range(given.lots):
            columns, at = list(drawn_lot(sources, given.parts, rng)), int(rng.integers(len(sources)))
            columns[at] = moved(columns[at], shift, factor)
            is_named = sources[at].name in [own.name for own in judged(columns, drawing, lots).moved]
            named[columns[at].gauge][0] += is_named
            named[columns[at].gauge][1] += 1
        all_named = sum(one for one, _ in named.values())
        of_each = ", ".join(f"{gauge.value} {one} of {all_}" for gauge, (one, all_) in named.items() if all_)
        print(f"{shift:g} σ, or times {factor:g}: named in {all_named} of {given.lots} lots ({of_each})")


if __name__ == "__main__":
    main()
