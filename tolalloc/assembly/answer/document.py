"""An assembly as a report: what is turned, what it leaves, what that does, and what angular tolerances cost."""

from __future__ import annotations

import numpy as np

from tolalloc.assembly.answer import figures, tables, tolerance_tables, transmission
from tolalloc.assembly.answer.cautions import WHY_LARGER, assumptions, warnings
from tolalloc.assembly.answer.characteristics import characteristic_table, larger
from tolalloc.assembly.answer.results import AngularTolerances, AssemblyResults, MeasuredParts, TransmissionEffect
from tolalloc.assembly.answer.sentences import answer
from tolalloc.assembly.answer.summary import finite_difference, summary
from tolalloc.report.document import Document, Section
from tolalloc.units import ARCSECOND

_EXPECTED = (
    "No part is measured yet, so angles and turns below are three standard deviations of what is expected; noise is "
    "what perfect parts would be left with."
)

_MISSED = (
    "All turns follow from the errors in the file and are made as listed, without measuring again; each misses by the "
    "adjustment noise. A limit is kept (yes) where three standard deviations of that still fit below it, in doubt "
    "where they do not, and missed (no) where the angle as listed is beyond it. Of a tilt the larger axis counts."
)


def _steps(results: AssemblyResults) -> Section:
    """Return how errors build up and are adjusted."""
    measured = results.measured
    angles = (("angles", tables.angle_table(results)),) if measured else ()
    return Section(
        heading="How errors build up and are adjusted",
        paragraphs=(
            f"A part is mounted, {'' if measured else 'then measured, '}then the parts of that step are turned about "
            "their own axes, positive by the right hand. Tilt is √(x² + y²) and rotation z of a characteristic against "
            f"{results.plan.chain.datum}.",
            *((_MISSED, *_larger_angles(results, measured)) if measured else (_EXPECTED,)),
        ),
        figures=figures.step_figures(results),
        tables=(
            ("steps", tables.step_table(results)),
            ("characteristics", characteristic_table(results)),
            *angles,
            ("gains", tables.gain_table(results)),
        ),
    )


def _larger_angles(results: AssemblyResults, measured: MeasuredParts) -> tuple[str, ...]:
    """Return how many single angles adjusting leaves larger."""
    before, after = measured.unadjusted / ARCSECOND, measured.adjusted / ARCSECOND
    rose = np.argwhere(np.abs(after) > np.abs(before))
    if not rose.size:
        return ()
    named = ", ".join(
        f"{results.plan.chain.names[at]} about {'xyz'[axis]} ({before[at, axis]:.2f} → {after[at, axis]:.2f}″)"
        for at, axis in rose
    )
    return (
        f"The {tables.norm_of(results)} of all angles falls, a single angle need not. Larger adjusted than unadjusted: "
        f"{len(rose)} of {before.size}, {named}.",
    )


def _sweep(results: AssemblyResults) -> Section:
    rose = larger(results)
    return Section(
        heading="Precision against effort",
        paragraphs=(
            f"{_bought(results)} {len(rose) or 'None'} of {2 * len(results.plan.chain.names)} tilts and rotations "
            f"{'is' if len(rose) == 1 else 'are'} larger than unadjusted at Q = {results.plan.precision:g}.",
        ),
        figures=figures.sweep_figures(results),
        tables=(("sweep", tables.sweep_table(results)),),
    )


def _bought(results: AssemblyResults) -> str:
    """Return what a larger precision does to all angles together, as far as the sweep shows."""
    sweep = results.sweep
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


def _transmission(results: AssemblyResults, effect: TransmissionEffect) -> Section:
    fallen = transmission.fallen_table(effect)
    which = "the measured parts" if results.measured else "the first random assembly; of others they look otherwise"
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
            transmission.pressure_map(effect, results.plan.precision),
            transmission.deformation_figure(effect),
        ),
        tables=(
            ("transmission", transmission.value_table(effect)),
            ("above perfect parts", transmission.difference_table(effect)),
            *((("smaller than unadjusted", fallen),) if len(fallen) else ()),
        ),
    )


def _tolerances(results: AssemblyResults, tolerances: AngularTolerances) -> Section:
    tuned = (
        "Re-tuned: it expects what is allocated with it."
        if tolerance_tables.is_retuned(tolerances)
        else "Tuning it to what is allocated gains nothing here."
    )
    best = (
        " Best precision: the filter of the stated tolerances, at the precision that costs least."
        if tolerance_tables.is_priced(results.plan)
        else ""
    )
    return Section(
        heading="Angular tolerances",
        paragraphs=(
            f"Adjusted: the filter expects parts of the stated tolerances. {tuned}{best} A lower bound takes no "
            "solver's word and holds for the gains of its own row.",
            f"Verified is “{tolerance_tables.verified_name(results.plan, tolerances)}”. An assembly is within a limit "
            "where its own tilt or rotation is; three standard deviations of x and y together promise between 99.73 % "
            "and 99.99 % of that.",
        ),
        figures=(figures.cost_figure(results.plan, tolerances),),
        tables=(
            ("angular tolerances", tolerance_tables.tolerance_table(results.plan, tolerances)),
            ("limits", tolerance_tables.limit_table(results.plan, tolerances)),
            ("certificates", tolerance_tables.certificate_table(results.plan, tolerances)),
            ("cost by precision", tolerance_tables.precision_table(tolerances)),
        ),
    )


def _finite(measured: MeasuredParts) -> Section:
    return Section(
        heading="Finite rotations",
        paragraphs=(
            f"Rotations do not add up as vectors do. For {measured.name}, unadjusted, the largest difference that this "
            f"makes in an angle is {finite_difference(measured):.2g}″.",
        ),
    )


def assembly_document(results: AssemblyResults) -> Document:
    """Return the report."""
    plan, measured = results.plan, results.measured
    tolerances = tolerance_tables.limited_tolerances(results)
    parts = measured.name if measured else "parts within the stated tolerances"
    return Document(
        title=f"Assembly of {plan.name}",
        subtitle=f"{len(plan.chain.names)} parts on {plan.chain.datum}, precision {plan.precision:g}, {parts}",
        answer=answer(results),
        warnings=warnings(results),
        sections=(
            _steps(results),
            _sweep(results),
            *((_transmission(results, results.transmission),) if results.transmission else ()),
            *((_tolerances(results, tolerances),) if tolerances else ()),
            *((_finite(measured),) if measured else ()),
        ),
        assumptions=assumptions(results),
        summary=summary(results),
        seed=results.seed,
    )
