"""An assembly as a report: what is turned, what it leaves, what that does, and what angular tolerances cost."""

from __future__ import annotations

import numpy as np

from tolalloc.report.assembly import figures, tables, tolerance_tables, transmission
from tolalloc.report.assembly.cautions import assumptions, warnings
from tolalloc.report.assembly.results import AngularTolerances, AssemblyResults, MeasuredParts, TransmissionEffect
from tolalloc.report.assembly.sentences import answer
from tolalloc.report.assembly.summary import finite_difference, summary
from tolalloc.report.document import Document, Section
from tolalloc.units import ARCSECOND

_EXPECTED = (
    "No part is measured yet, so angles and turns below are three standard deviations of what is expected; noise is "
    "what perfect parts would be left with."
)


def _steps(results: AssemblyResults) -> Section:
    """Return how errors build up and are adjusted."""
    measured = results.measured
    angles = (("angles", tables.angle_table(results)),) if measured else ()
    return Section(
        heading="How errors build up and are adjusted",
        paragraphs=(
            "A part is mounted, then measured, then the parts of that step are turned about their own axes, positive "
            "by the right hand. Tilt is √(x² + y²) and rotation z of a characteristic against "
            f"{results.plan.chain.datum}.",
            *(_larger_angles(results, measured) if measured else (_EXPECTED,)),
        ),
        figures=figures.step_figures(results),
        tables=(
            ("steps", tables.step_table(results)),
            ("characteristics", tables.characteristic_table(results)),
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
        f"The sum of squares falls, a single angle need not: {len(rose)} of {before.size} are larger adjusted than "
        f"unadjusted, {named}.",
    )


def _sweep(results: AssemblyResults) -> Section:
    rose = tables.larger(results)
    return Section(
        heading="Precision against effort",
        paragraphs=(
            "The larger the precision Q, the smaller what is left of all angles together and the larger the effort of "
            "turning; each unit of Q buys less than the one before. A single characteristic may rise meanwhile: at "
            f"Q = {results.plan.precision:g}, {len(rose) or 'none'} of {2 * len(results.plan.chain.names)} tilts and "
            "rotations are larger than unadjusted.",
        ),
        figures=figures.sweep_figures(results),
        tables=(("sweep", tables.sweep_table(results)),),
    )


def _transmission(results: AssemblyResults, effect: TransmissionEffect) -> Section:
    fallen = transmission.fallen_table(effect)
    which = "the measured parts" if results.measured else "the first random assembly; of others they look otherwise"
    return Section(
        heading="Transmission",
        paragraphs=(
            "A tilted disc loads one end of its teeth: as tilts fall, so does the largest line load, mostly. "
            "Transmission error and the largest pin force need not: a wedge between disc and pins can bring more pins "
            f"to carry. Where no torque is named, it is the test torque of {effect.test_torque:g} N·m.",
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
    return Section(
        heading="Angular tolerances",
        paragraphs=(
            "Adjusted: the filter expects parts of the stated tolerances. Re-tuned: it expects what is allocated with "
            "it. A lower bound takes no solver's word and holds for the gains of its own row.",
            "Verified are the re-tuned tolerances. An assembly is within a limit where its own tilt or rotation is; "
            "three standard deviations of x and y together promise between 99.73 % and 99.99 % of that.",
        ),
        figures=(figures.cost_figure(results.plan, tolerances),),
        tables=(
            ("angular tolerances", tolerance_tables.tolerance_table(results.plan, tolerances)),
            ("limits", tolerance_tables.limit_table(tolerances)),
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
            *((_tolerances(results, results.tolerances),) if results.tolerances else ()),
            *((_finite(measured),) if measured else ()),
        ),
        assumptions=assumptions(results),
        summary=summary(results),
        seed=results.seed,
    )
