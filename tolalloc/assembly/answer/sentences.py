"""The answer of an assembly in sentences, each no stronger than what was computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolalloc.assembly.answer.tables import at_precision, norm_of
from tolalloc.assembly.answer.tolerance_tables import is_priced, is_retuned, limited_tolerances, verified_name
from tolalloc.assembly.answer.transmission import LINE_LOAD, PIN_FORCE, RATED_PEAK_TO_PEAK, answers, change, perfect
from tolalloc.assembly.orientations import TransmissionEffect
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers import PEAK_TO_PEAK

if TYPE_CHECKING:
    from tolalloc.assembly.answer.answer import AdjustedParts, AngularTolerances, AssemblyAnswer

LITTLE = 0.01
"""Share of all final angles below which another unit of precision buys little [-]."""


def sentences(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return the answer in sentences."""
    tolerances, effect = limited_tolerances(answer), answer.transmission
    return (
        _measured(answer, answer.measured) if answer.measured else _expected(answer),
        _diminishing(answer),
        *(_transmission(effect, answer.plan.precision) if effect else ()),
        *(_costs(answer, tolerances) if tolerances else ()),
    )


def _measured(answer: AssemblyAnswer, measured: AdjustedParts) -> str:
    before, after = measured.norms[[0, at_precision(answer)]] / ARCSECOND
    return (
        f"{measured.name}: adjusting at a precision of {answer.plan.precision:g} takes the {norm_of(answer)} of all "
        f"final angles from {before:.2f}″ to {after:.2f}″, if every part is turned exactly as listed."
    )


def _expected(answer: AssemblyAnswer) -> str:
    sweep, at = answer.sweep, at_precision(answer)
    before, after, floor = np.array([sweep.total[0], sweep.total[at], sweep.noise_floor]) / ARCSECOND
    return (
        f"Parts within the stated tolerances leave {before:.2f}″ rms of all final angles unadjusted, {after:.2f}″ "
        f"adjusted at a precision of {answer.plan.precision:g}; however large the precision, this plan leaves "
        f"{floor:.2f}″."
    )


def _diminishing(answer: AssemblyAnswer) -> str:
    """Return where another unit of precision buys little, and where it makes things worse."""
    sweep = answer.sweep
    found = sweep.diminished(LITTLE)
    floor = (
        f"; however large the precision, this plan leaves {sweep.noise_floor / ARCSECOND:.2f}″ rms of it"
        if answer.measured
        else ""
    )
    if found is None:
        return (
            f"At the largest precision tried, {sweep.precisions[-1]:g}, another unit still takes off "
            f"{sweep.next_unit[-1]:.1%} of what is to be expected of all final angles{floor}."
        )
    adding = sweep.precisions[(sweep.precisions >= found) & (sweep.next_unit < 0)]
    adds = f", and at {adding[0]:g} it adds to it" if adding.size else ""
    return (
        f"From a precision of {found:g} on, another unit takes less than {LITTLE:.0%} off what is to be expected of "
        f"all final angles{adds}{floor}."
    )


def _transmission(effect: TransmissionEffect, precision: float) -> tuple[str, ...]:
    """Return what adjusting gains: the line load, and outputs that need not follow the angles."""
    at = int(np.flatnonzero(effect.precisions == precision)[0])
    single = effect.good.size == 1

    def said(output: str) -> str:
        values, unit = answers(effect, output), output.removesuffix("]").split(" [")[1]
        before, after = change(effect, output, precision)
        counted = "" if single else f", smaller in {int((values[at] < values[0]).sum())} of {values.shape[1]}"
        return f"{before:.4g} → {after:.4g} {unit} (perfect parts: {perfect(effect, output):.4g} {unit}{counted})"

    of_them = "" if single else f", medians of {int(effect.good.sum())} random assemblies"
    return (
        f"Largest line load at rated torque{of_them}: {said(LINE_LOAD)}.",
        f"Peak-to-peak transmission error at {effect.test_torque:g} N·m: {said(PEAK_TO_PEAK)}, at rated torque: "
        f"{said(RATED_PEAK_TO_PEAK)}; largest pin force at rated torque: {said(PIN_FORCE)}. None of these three need "
        "fall with the angles.",
    )


def _costs(answer: AssemblyAnswer, tolerances: AngularTolerances) -> tuple[str, ...]:
    """Return what the cheapest tolerances cost, with and without adjusting."""
    adjusted, best = tolerances.adjusted, tolerances.retuned.best
    without = (
        "without adjusting no tolerances keep the limits"
        if isinstance(tolerances.unadjusted, str)
        else f"{tolerances.unadjusted.total:.2f} without adjusting"
    )
    tuned = (
        f"A filter tuned to what is allocated brings them to {best.total:.2f}, {1 - best.total / adjusted.total:.1%} "
        "less."
        if is_retuned(tolerances)
        else "Tuning the filter to what is allocated gains nothing here."
    )
    return (
        f"Cheapest tolerances that keep all limits: {adjusted.total:.2f} cost units with adjusting at a precision of "
        f"{adjusted.gains.precision:g}, {without}. Certified: with these gains no "
        f"tolerances that keep them cost less than {adjusted.bound:.2f} (gap {max(adjusted.gap, 0.0):.1g}).",
        tuned,
        *_best_precision(answer, tolerances),
        _verified(answer, tolerances),
    )


def _best_precision(answer: AssemblyAnswer, tolerances: AngularTolerances) -> tuple[str, ...]:
    """Return the precision that costs least, nothing where turning has no price."""
    found = tolerances.by_precision
    if not is_priced(answer.plan):
        return ()
    end = "" if found.interior else ", the end of the range that was searched"
    return (
        f"With effort priced, a precision of {found.best.gains.precision:.4g}{end} costs least: "
        f"{found.best.total:.2f} cost units, {tolerances.adjusted.total:.2f} at {answer.plan.precision:g}.",
    )


def _verified(answer: AssemblyAnswer, tolerances: AngularTolerances) -> str:
    """Return how many random assemblies keep all limits, and with which of the tolerances."""
    share, precision = tolerances.verification.share, f"a precision of {tolerances.verified.gains.precision:.4g}"
    which = {
        "adjusted": f"the tolerances for {precision}",
        "re-tuned": f"the tolerances of the tuned filter at {precision}",
        "best precision": f"the tolerances for the best precision of {tolerances.verified.gains.precision:.4g}",
    }[verified_name(answer.plan, tolerances)]
    return (
        f"Of {tolerances.verification.assemblies} random assemblies with {which}, {share.estimate:.2%} are within all "
        f"limits at once (95 % interval {share.low:.2%}…{share.high:.2%})."
    )
