"""What a reader of an assembly must know before acting on it: warnings, and what no source states."""

from __future__ import annotations

from itertools import product

import numpy as np

from tolalloc.report.assembly.results import AngularTolerances, AssemblyResults
from tolalloc.report.assembly.tables import characteristic_table, larger
from tolalloc.units import ARCSECOND


def warnings(results: AssemblyResults) -> tuple[str, ...]:
    """Return what a reader must know before acting on the answer."""
    rose = larger(results)
    return (
        *_not_there(results),
        *_beyond(results),
        *_missed(results),
        *((f"Adjusting leaves larger than unadjusted: {', '.join(rose)}.",) if rose else ()),
        *_failed(results),
        *((f"No angular tolerances are given. {results.unreachable}",) if results.unreachable else ()),
        *(_of_tolerances(results.tolerances) if results.tolerances else ()),
    )


def _not_there(results: AssemblyResults) -> tuple[str, ...]:
    """Return which steps turn parts that are mounted later."""
    order = [step.mount for step in results.plan.steps]
    steps = [str(at + 1) for at, step in enumerate(results.plan.steps) if set(step.adjust) - set(order[: at + 1])]
    return (f"Turns of parts that are mounted later cannot be made: steps {', '.join(steps)}.",) if steps else ()


def _beyond(results: AssemblyResults) -> tuple[str, ...]:
    """Return which measured errors are larger than their tolerance."""
    if results.measured is None:
        return ()
    tolerances = results.plan.tolerances
    # Both come from decimals of an arcsecond; an error equal to its tolerance is not beyond it.
    beyond = np.abs(results.measured.errors) > tolerances * (1 + 1e-12)
    found = [
        f"{name} about {'xyz'[axis]} ({results.measured.errors[at, axis] / ARCSECOND:+.2f}″, "
        f"±{tolerances[at, axis] / ARCSECOND:g}″)"
        for (at, name), axis in product(enumerate(results.plan.chain.names), range(3))
        if beyond[at, axis]
    ]
    return (f"Beyond their stated tolerance: {', '.join(found)}.",) if found else ()


def _missed(results: AssemblyResults) -> tuple[str, ...]:
    """Return which limits are not kept, by the measured parts or by the stated tolerances."""
    frame = characteristic_table(results)
    if "OK" not in frame:
        return ()
    missed = [
        f"{row['angle']} of {row['characteristic']} ({abs(row.iloc[3]):.2f}″, limit {row['limit [arcsec]']:g}″)"
        for _, row in frame[frame["OK"] == "no"].iterrows()
    ]
    by = "Adjusted, these parts" if results.measured else "Three standard deviations under the stated tolerances"
    return (f"{by} miss limits: {', '.join(missed)}.",) if missed else ()


def _failed(results: AssemblyResults) -> tuple[str, ...]:
    """Return how many random assemblies are left out."""
    failed = int((~results.transmission.good).sum()) if results.transmission else 0
    return (f"Assemblies without equilibrium, left out of the transmission: {failed}.",) if failed else ()


def _of_tolerances(tolerances: AngularTolerances) -> tuple[str, ...]:
    """Return what is not proven of the allocations."""
    found = []
    if isinstance(tolerances.unadjusted, str):
        found.append(f"Without adjusting: {tolerances.unadjusted}")
    if tolerances.retuned.best.total < tolerances.adjusted.total:
        found.append(
            "The lower bound of the re-tuned tolerances holds for their own gains: that no other filter allows cheaper "
            "ones is not proven."
        )
    if not tolerances.retuned.settled:
        found.append("Tuning the filter again has not settled; the cheapest of the allocations is given.")
    return tuple(found)


def assumptions(results: AssemblyResults) -> tuple[str, ...]:
    """Return what no source states."""
    transmission = results.transmission
    return (
        *results.plan.assumptions,
        *(transmission.reducer.assumptions if transmission else ()),
        "angles are small: they add up as vectors; what finite rotations change is stated",
        "errors of parts, readings and adjustments are normal and independent; a tolerance is three standard "
        "deviations",
        "adjustments are those of a linear-quadratic regulator: they weigh final angles against effort and know no "
        "smallest turn",
        *(
            ("all parts are measured before the first is mounted, exactly, and turned exactly as listed",)
            if results.measured
            else ()
        ),
        *(
            ("the certificates hold for fixed gains; the filter of the adjusted tolerances expects the stated ones",)
            if results.tolerances
            else ()
        ),
        *(("every error of the reducer but these angles is zero",) if transmission else ()),
    )
