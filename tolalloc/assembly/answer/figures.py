"""The figures of an assembly: angles over the steps, and what precision and tolerances cost."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.answer.answer import AngularTolerances, AssemblyAnswer
from tolalloc.assembly.answer.tables import at_precision, norm_of, states, tilt_and_rotation
from tolalloc.assembly.answer.tolerance_tables import is_priced
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.report.figure import Figure, Series
from tolalloc.units import ARCSECOND


def step_figures(answer: AssemblyAnswer) -> tuple[Figure, Figure]:
    """Return tilt and rotation of every characteristic from the step that mounts it."""
    tilt, rotation = tilt_and_rotation(states(answer))
    kind = "" if answer.measured else ", three standard deviations"
    return (
        _over_steps(answer, "tilt", f"tilt{kind} [arcsec]", tilt),
        _over_steps(answer, "rotation", f"rotation{kind} [arcsec]", rotation),
    )


def _over_steps(answer: AssemblyAnswer, name: str, y_label: str, angles: Float[np.ndarray, "step 2 part"]) -> Figure:
    mounted = [step.mount for step in answer.plan.steps]
    where = np.arange(1, len(mounted) + 1)[:, np.newaxis] + [0.0, 0.5]
    return Figure(
        name=name,
        title=f"{name.capitalize()} of every characteristic: at each step as mounted, half a step on as adjusted",
        x_label="step [-]",
        y_label=y_label,
        series=tuple(
            Series(
                label=part,
                kind="line",
                x=list(where[mounted.index(part) :].ravel()),
                y=list(angles[mounted.index(part) :, :, at].ravel() / ARCSECOND),
            )
            for at, part in enumerate(answer.plan.chain.names)
        ),
    )


def sweep_figures(answer: AssemblyAnswer) -> tuple[Figure, Figure]:
    """Return what is left over the precision, and against the effort."""
    sweep = answer.sweep
    total, floor = sweep.total / ARCSECOND, (sweep.noise_floor / ARCSECOND, "")
    turned = sweep.precisions > 0
    expected = Series(
        label="to be expected of all angles, rms", kind="line", x=list(sweep.precisions[turned]), y=list(total[turned])
    )
    measured: tuple[Series, ...] = ()
    if answer.measured:
        name, norms = f"{norm_of(answer)} of {answer.measured.name}", answer.measured.norms[turned] / ARCSECOND
        measured = (Series(label=name, kind="line", x=expected.x, y=list(norms)),)
    return (
        Figure(
            name="precision",
            title="What is left of the angles over the precision; dashed: to be expected however large it is",
            x_label="precision Q [-]",
            y_label="all final angles together [arcsec]",
            series=(expected, *measured, *_asked(answer)),
            horizontal=(floor,),
            logarithmic_x=True,
        ),
        Figure(
            name="effort",
            title="Effort against accuracy; dashed: what this plan leaves however large the precision",
            x_label="expected effort, Σ uᵀRu [arcsec²]",
            y_label="all final angles together, rms [arcsec]",
            series=(Series(label="to be expected", kind="line", x=list(sweep.effort / ARCSECOND**2), y=list(total)),),
            horizontal=(floor,),
        ),
    )


def _asked(answer: AssemblyAnswer) -> tuple[Series, ...]:
    """Return the precision that was asked for; 0 has no place on a logarithmic axis."""
    precision, total = answer.plan.precision, answer.sweep.total[at_precision(answer)] / ARCSECOND
    return (Series(label=f"at Q = {precision:g}", kind="points", x=[precision], y=[total]),) if precision > 0 else ()


def cost_figure(plan: AssemblyPlan, tolerances: AngularTolerances) -> Figure:
    """Return what tolerances and effort cost over the precision."""
    found = tolerances.by_precision
    known = np.isfinite(found.total)
    costs = {"tolerances": found.cost, "effort": found.effort_cost, "both": found.total}
    priced, best = is_priced(plan), found.best
    least = Series(label="least of both", kind="points", x=[best.gains.precision], y=[best.total])
    return Figure(
        name="cost",
        title="Cost of the cheapest tolerances over the precision, the filter tuned to the stated ones",
        x_label="precision Q [-]",
        y_label="cost [cost units]",
        series=(
            *(
                Series(label=label, kind="line", x=list(found.precisions[known]), y=list(values[known]))
                for label, values in costs.items()
                if priced or label == "tolerances"
            ),
            *((least,) if priced else ()),
        ),
        logarithmic_x=True,
    )
