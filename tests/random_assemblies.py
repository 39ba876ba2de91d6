"""Random assemblies, for tests."""

from __future__ import annotations

import numpy as np

from tolalloc.assembly.chain import DatumFlowChain, Part
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.steps import AssemblyStep
from tolalloc.reading.units import ARCSECOND


def random_plan(seed: int) -> AssemblyPlan:
    """Return a tree of three to six parts that are turned, weighted and measured as it comes, also between parts."""
    generator = np.random.default_rng(seed)
    names = [f"KC{number}" for number in range(1, int(generator.integers(4, 8)))]
    parts = tuple(
        Part(
            name=name,
            on=str(generator.choice(["KC0", *names[:at]])),
            turned=tuple(generator.uniform(-np.pi, np.pi, 3).tolist()),
        )
        for at, name in enumerate(names)
    )
    steps = []
    for at, name in enumerate(names):
        there, earlier = names[: at + 1], names[:at]
        between = [f"{name} - {generator.choice(earlier)}"] if earlier else []
        steps.append(
            AssemblyStep(
                mount=name,
                adjust=tuple(one for one in there if generator.random() < 0.7),
                effort={one: float(generator.uniform(0.5, 20)) for one in there},
                measure=(*(one for one in there if generator.random() < 0.5), *between),
            )
        )
    return AssemblyPlan(
        name=f"plan {seed}",
        source="random",
        chain=DatumFlowChain(datum="KC0", parts=parts),
        steps=tuple(steps),
        tolerances=generator.uniform(5, 60, (len(names), 3)) * ARCSECOND,
        precision=float(generator.uniform(0.5, 20)),
        weights=generator.uniform(0.2, 3, len(names)),
        measurement_noise=2 * ARCSECOND,
        adjustment_noise=1 * ARCSECOND,
    )
