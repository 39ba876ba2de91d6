"""What a reader of an assembly must know before acting on it: warnings, and what no source states."""

from __future__ import annotations

from collections.abc import Hashable
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from tolalloc.assembly.answer.tables import MISSED, at_precision, has_limits, larger
from tolalloc.assembly.answer.tolerance_tables import is_retuned, limited_tolerances
from tolalloc.assembly.answer.transmission import risen
from tolalloc.reading.units import ARCSECOND

if TYPE_CHECKING:
    from tolalloc.assembly.answer.answer import AdjustedParts, AngularTolerances, AssemblyAnswer

WHY_LARGER = (
    "Discs that are turned against each other share the load unequally: at a small torque one carries alone and hides "
    "the errors of the other. A tilted disc wedges between the pins, so that more of them carry. Smaller angles end "
    "both, and transmission error and forces can rise."
)
_SAME = 1e-6
"""Share by which totals may differ by rounding [-]."""


def warnings(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return what a reader must know before acting on the answer."""
    rose, tolerances = larger(answer), limited_tolerances(answer)
    return (
        *_not_there(answer),
        *_beyond(answer),
        *_missed(answer),
        *((f"Adjusting leaves larger than unadjusted: {', '.join(rose)}.",) if rose else ()),
        *_fewer(answer),
        *_risen(answer),
        *_failed(answer),
        *_unlimited(answer),
        *((f"No angular tolerances are given. {answer.unreachable}",) if answer.unreachable else ()),
        *(_of_tolerances(tolerances) if tolerances else ()),
    )


def _not_there(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return which steps turn parts that are mounted later."""
    order = [step.mount for step in answer.plan.steps]
    steps = [str(at + 1) for at, step in enumerate(answer.plan.steps) if set(step.adjust) - set(order[: at + 1])]
    return (f"Turns of parts that are mounted later cannot be made: steps {', '.join(steps)}.",) if steps else ()


def _beyond(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return which measured errors are larger than their tolerance."""
    if answer.measured is None:
        return ()
    tolerances = answer.plan.tolerances
    # Both come from decimals of an arcsecond; an error equal to its tolerance is not beyond it.
    beyond = np.abs(answer.measured.errors) > tolerances * (1 + 1e-12)
    found = [
        f"{name} about {'xyz'[axis]} ({answer.measured.errors[at, axis] / ARCSECOND:+.2f}″, "
        f"±{tolerances[at, axis] / ARCSECOND:g}″)"
        for (at, name), axis in product(enumerate(answer.plan.chain.names), range(3))
        if beyond[at, axis]
    ]
    return (f"Beyond their stated tolerance: {', '.join(found)}.",) if found else ()


def _missed(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return which limits are not kept, by the measured parts or by the stated tolerances, and what would keep them."""
    frame = answer.characteristics
    if "OK" not in frame:
        return ()
    missed, doubted = (
        ", ".join(map(_limited, frame[frame["OK"] == word].to_dict("records"))) for word in ("no", "in doubt")
    )
    by = "Adjusted, these parts" if answer.measured else "Three standard deviations under the stated tolerances"
    remedy = f" {_remedy(answer.measured)}" if answer.measured else ""
    doubt = "Kept as listed, but three standard deviations of what the turns miss reach beyond the limit"
    return (
        *((f"{by} miss limits: {missed}.{remedy}",) if missed else ()),
        *((f"{doubt}: {doubted}.",) if doubted else ()),
    )


def _limited(row: dict[Hashable, Any]) -> str:
    after = abs(row.get("after [arcsec]", row.get("after, 3σ [arcsec]", 0.0)))
    missed = f" ± {row[MISSED]:.2f}" if MISSED in row else ""
    return f"{row['angle']} of {row['characteristic']} ({after:.2f}{missed}″, limit {row['limit [arcsec]']:g}″)"


def _remedy(measured: AdjustedParts) -> str:
    if measured.keeping is None:
        return "No precision that was tried keeps them all."
    return f"Turned as listed for a precision of {measured.keeping:.4g}, they keep them all."


def _fewer(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return whether it is better to leave alone what was adjusted before."""
    total = answer.sweep.total[at_precision(answer)]
    if answer.fewer is None or answer.fewer >= total * (1 - _SAME):
        return ()
    noise = answer.plan.adjustment_noise / ARCSECOND
    why = f": every further adjustment misses by {noise:g}″ itself" if noise else ""
    return (
        f"Turning at every step only the part just mounted leaves {answer.fewer / ARCSECOND:.2f}″ rms instead of "
        f"{total / ARCSECOND:.2f}″{why}.",
    )


def _risen(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return which outputs of the transmission adjusting leaves larger, and how that can be."""
    effect = answer.transmission
    rose = risen(effect, answer.plan.precision) if effect else ()
    if effect is None or not rose:
        return ()
    of_them = "" if effect.good.size == 1 else f", medians of {int(effect.good.sum())} random assemblies"
    return (f"Adjusting leaves larger than unadjusted{of_them}: {', '.join(rose)}. {WHY_LARGER}",)


def _unlimited(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return that costs alone make no tolerances."""
    if answer.plan.requirements is None or has_limits(answer):
        return ()
    return ("No limits are stated, so no angular tolerances are given.",)


def _failed(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return how many random assemblies are left out."""
    failed = int((~answer.transmission.good).sum()) if answer.transmission else 0
    return (f"Assemblies without equilibrium, left out of the transmission: {failed}.",) if failed else ()


def _of_tolerances(tolerances: AngularTolerances) -> tuple[str, ...]:
    """Return what is not proven of the allocations."""
    found = []
    if isinstance(tolerances.unadjusted, str):
        found.append(f"Without adjusting: {tolerances.unadjusted}")
    if is_retuned(tolerances):
        found.append(
            "The lower bound of the re-tuned tolerances holds for their own gains: that no other filter allows cheaper "
            "ones is not proven."
        )
    if not tolerances.retuned.settled:
        found.append("Tuning the filter again has not settled; the cheapest of the allocations is given.")
    return tuple(found)


def assumptions(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return what no source states."""
    transmission = answer.transmission
    return (
        *answer.header.assumptions,
        "angles are small: they add up as vectors; what finite rotations change is stated",
        "errors of parts, readings and adjustments are normal and independent; a tolerance is three standard "
        "deviations",
        "adjustments are those of a linear-quadratic regulator: they weigh final angles against effort and know no "
        "smallest turn",
        *(
            (
                "all parts are measured before the first is mounted, exactly, and turned as listed, without measuring "
                "again",
            )
            if answer.measured
            else ()
        ),
        *(
            ("the certificates hold for fixed gains; the filter of the adjusted tolerances expects the stated ones",)
            if limited_tolerances(answer)
            else ()
        ),
        *(("every error of the reducer but these angles is zero",) if transmission else ()),
    )
