"""The sections of the report on an assembly with their figures: steps, precision, transmission, tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.answer import tables, tolerance_tables, transmission
from tolalloc.assembly.answer.cautions import WHY_LARGER
from tolalloc.assembly.answer.summary import finite_difference
from tolalloc.assembly.answer.tables import at_precision, larger, norm_of, states, tilt_and_rotation
from tolalloc.assembly.answer.tolerance_tables import is_priced
from tolalloc.assembly.orientations import TransmissionEffect
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.reading.units import ARCSECOND
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series

if TYPE_CHECKING:
    from tolalloc.assembly.answer.answer import AdjustedParts, AngularTolerances, AssemblyAnswer

_EXPECTED = (
    "No part is measured yet, so angles and turns below are three standard deviations of what is expected; noise is "
    "what perfect parts would be left with."
)

_MISSED = (
    "All turns follow from the errors in the file and are made as listed, without measuring again; each misses by the "
    "adjustment noise. A limit is kept (yes) where three standard deviations of that still fit below it, in doubt "
    "where they do not, and missed (no) where the angle as listed is beyond it. Of a tilt the larger axis counts."
)


def _steps(answer: AssemblyAnswer) -> Section:
    """Return how errors build up and are adjusted."""
    measured = answer.measured
    angles = (("angles", tables.angle_table(answer)),) if measured else ()
    return Section(
        heading="How errors build up and are adjusted",
        paragraphs=(
            f"A part is mounted, {'' if measured else 'then measured, '}then the parts of that step are turned about "
            "their own axes, positive by the right hand. Tilt is √(x² + y²) and rotation z of a characteristic against "
            f"{answer.plan.chain.datum}.",
            *((_MISSED, *_larger_angles(answer, measured)) if measured else (_EXPECTED,)),
        ),
        figures=step_figures(answer),
        tables=(
            ("steps", tables.step_table(answer)),
            ("characteristics", answer.characteristics),
            *angles,
            ("gains", tables.gain_table(answer)),
        ),
    )


def _larger_angles(answer: AssemblyAnswer, measured: AdjustedParts) -> tuple[str, ...]:
    """Return how many single angles adjusting leaves larger."""
    before, after = measured.unadjusted / ARCSECOND, measured.adjusted / ARCSECOND
    rose = np.argwhere(np.abs(after) > np.abs(before))
    if not rose.size:
        return ()
    named = ", ".join(
        f"{answer.plan.chain.names[at]} about {'xyz'[axis]} ({before[at, axis]:.2f} → {after[at, axis]:.2f}″)"
        for at, axis in rose
    )
    return (
        f"The {tables.norm_of(answer)} of all angles falls, a single angle need not. Larger adjusted than unadjusted: "
        f"{len(rose)} of {before.size}, {named}.",
    )


def _sweep(answer: AssemblyAnswer) -> Section:
    rose = larger(answer)
    return Section(
        heading="Precision against effort",
        paragraphs=(
            f"{_bought(answer)} {len(rose) or 'None'} of {2 * len(answer.plan.chain.names)} tilts and rotations "
            f"{'is' if len(rose) == 1 else 'are'} larger than unadjusted at Q = {answer.plan.precision:g}.",
        ),
        figures=sweep_figures(answer),
        tables=(("sweep", tables.sweep_table(answer)),),
    )


def _bought(answer: AssemblyAnswer) -> str:
    """Return what a larger precision does to all angles together, as far as the sweep shows."""
    sweep = answer.sweep
    least = int(np.argmin(sweep.total))
    if (np.diff(sweep.total) <= 0).all() and sweep.total[least] < sweep.total[0]:
        each = "; each unit of Q buys less than the one before" if (np.diff(sweep.next_unit) <= 0).all() else ""
        return (
            "Over the precisions tried, the larger Q, the smaller what is to be expected of all angles together and "
            f"the larger the effort of turning{each}. A single characteristic may rise meanwhile."
        )
    return (
        f"Of the precisions tried, Q = {sweep.precisions[least]:g} leaves least of all angles together, "
        f"{sweep.total[least] / ARCSECOND:.2f}″ rms; the effort of turning grows with Q."
    )


def _transmission(answer: AssemblyAnswer, effect: TransmissionEffect) -> Section:
    fallen = transmission.fallen_table(effect)
    which = "the measured parts" if answer.measured else "the first random assembly; of others they look otherwise"
    return Section(
        heading="Transmission",
        paragraphs=(
            "A tilted disc loads one end of its teeth: as tilts fall, so does the largest line load, mostly. "
            f"Transmission error and the largest pin force need not. {WHY_LARGER} Where no torque is named, it is the "
            f"test torque of {effect.test_torque:g} N·m.",
            f"Curves and pins are those of {which}. All pins are shown at one carrier angle, where the line load of "
            "the unadjusted disc is largest.",
        ),
        figures=(
            *transmission.curve_figures(effect),
            *transmission.precision_figures(effect),
            transmission.pressure_map(effect, answer.plan.precision),
            transmission.deformation_figure(effect),
        ),
        tables=(
            ("transmission", transmission.value_table(effect)),
            ("above perfect parts", transmission.difference_table(effect)),
            *((("smaller than unadjusted", fallen),) if len(fallen) else ()),
        ),
    )


def _tolerances(answer: AssemblyAnswer, tolerances: AngularTolerances) -> Section:
    tuned = (
        "Re-tuned: it expects what is allocated with it."
        if tolerance_tables.is_retuned(tolerances)
        else "Tuning it to what is allocated gains nothing here."
    )
    best = (
        " Best precision: the filter of the stated tolerances, at the precision that costs least."
        if tolerance_tables.is_priced(answer.plan)
        else ""
    )
    return Section(
        heading="Angular tolerances",
        paragraphs=(
            f"Adjusted: the filter expects parts of the stated tolerances. {tuned}{best} A lower bound takes no "
            "solver's word and holds for the gains of its own row.",
            f"Verified is “{tolerance_tables.verified_name(answer.plan, tolerances)}”. An assembly is within a limit "
            "where its own tilt or rotation is; three standard deviations of x and y together promise between 99.73 % "
            "and 99.99 % of that.",
        ),
        figures=(cost_figure(answer.plan, tolerances),),
        tables=(
            ("angular tolerances", tolerance_tables.tolerance_table(answer.plan, tolerances)),
            ("limits", tolerance_tables.limit_table(answer.plan, tolerances)),
            ("certificates", tolerance_tables.certificate_table(answer.plan, tolerances)),
            ("cost by precision", tolerance_tables.precision_table(tolerances)),
        ),
    )


def _finite(measured: AdjustedParts) -> Section:
    return Section(
        heading="Finite rotations",
        paragraphs=(
            f"Rotations do not add up as vectors do. For {measured.name}, unadjusted, the largest difference that this "
            f"makes in an angle is {finite_difference(measured):.2g}″.",
        ),
    )


def sections(answer: AssemblyAnswer) -> tuple[Section, ...]:
    """Return the sections of the report."""
    tolerances = tolerance_tables.limited_tolerances(answer)
    return (
        _steps(answer),
        _sweep(answer),
        *((_transmission(answer, answer.transmission),) if answer.transmission else ()),
        *((_tolerances(answer, tolerances),) if tolerances else ()),
        *((_finite(answer.measured),) if answer.measured else ()),
    )


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
