"""zhang2025's BX40E: what adjusting takes out of angular errors, what that does, and what the tolerances may cost then.

python studies/zhang2025_assembly.py [--quick] [--out FOLDER]
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from published.zhang2025_sections import (
    PRECISIONS,
    drawn_parts_section,
    exponential_section,
    genetic_section,
    mounting_section,
    pattern_section,
    priced_section,
)

import tolalloc as ta
from tolalloc.reading.units import ARCSECOND
from tolalloc.reports.document import Document
from tolalloc.running.progress import Progress
from tolalloc.wings.assembly.adjustment import AssemblyRequest
from tolalloc.wings.assembly.ask.assemble import assembled
from tolalloc.wings.assembly.files import load_plan

SEED = 20250711
"""Seed of the parts that stand for zhang2025's Table 3, which is lost."""


def parts_drawn() -> np.ndarray:
    """Return errors within ±60″, to 0.01″ [rad]."""
    return np.round(np.random.default_rng(SEED).uniform(-60, 60, (4, 3)), 2) * ARCSECOND


def build(quick: bool, progress: Progress) -> Document:
    """Return the report."""
    request = AssemblyRequest(
        plan=load_plan("bx40e"),
        name="Parts drawn within ±60″",
        errors=parts_drawn(),
        assemblies=10_000 if quick else 100_000,
    )
    document = assembled(request, progress).document
    plan = request.plan
    progress.begin("random parts")
    drawn, shares = drawn_parts_section(plan, 40 if quick else 200)
    mounting, mounted = mounting_section(3 if quick else 100, progress)
    genetic, searched = genetic_section(plan, 2 if quick else 10, progress)
    progress.begin("price of effort")
    priced, prices = priced_section(plan)
    return replace(
        document,
        title="BX40E of zhang2025: angular errors, adjustment, tolerances",
        answer=(*document.answer, shares, prices, searched, mounted),
        sections=(
            *document.sections,
            drawn,
            pattern_section(plan, parts_drawn(), PRECISIONS),
            priced,
            exponential_section(plan),
            genetic,
            mounting,
        ),
        assumptions=(
            *document.assumptions,
            f"errors of the parts drawn from ±60″ with seed {SEED}: zhang2025's Table 3 is lost",
        ),
    )


study = ta.Study(questions=[ta.Calculation(build)], name="zhang2025_assembly")

if __name__ == "__main__":
    ta.run_script()
