"""What drives a reducer's outputs: answer, warnings, sections and summary of one report."""

from __future__ import annotations

from typing import Any

import numpy as np

from tolalloc.drawing.seeds import SamplingDesign
from tolalloc.report.document import Document
from tolalloc.rv.response.kernel import PEAK_TO_PEAK
from tolalloc.sensitivity.answer import limit_tables
from tolalloc.sensitivity.answer.results import RankingResults
from tolalloc.sensitivity.answer.sections import driver_sections, limit_sections, trust_sections
from tolalloc.sensitivity.sobol_analysis import SobolIndices

_RARE = 1000.0
"""Units of a million from which a share is said in percent [-]."""
_SLIGHT = 0.05
"""Share of a wave's variance below which a second source is not named for it [-]."""
_MOSTLY = 0.5
"""Share of a wave's variance from single sources above which they are named for it [-]."""
_NAMED = 3
"""Sources that the answer names [-]."""


def answer(results: RankingResults) -> tuple[str, ...]:
    """Return the answer in sentences."""
    return (
        *_drivers(results.sobol.of(PEAK_TO_PEAK)),
        results.sobol.growth.status,
        *_reproduced(results),
        *_orders(results),
        *_rejects(results),
        *_beyond(results),
        _opening(results),
        results.choice.reason,
    )


def _reproduced(results: RankingResults) -> tuple[str, ...]:
    """Return what a second seed made of the promised orders, if any was promised."""
    found = results.reproduction
    if not found.promised:
        return ()
    return (
        f"A second seed shows {found.reproduced} of the {found.promised} pairs whose order was promised with "
        f"{found.confidence:.0%} confidence ({found.share:.1%} of them).",
    )


def _drivers(sobol: SobolIndices) -> tuple[str, ...]:
    """Return who drives the peak-to-peak, and how sure each place is."""
    interval, among = sobol.total_interval, sobol.among_first(min(_NAMED, len(sobol.sources)))
    following = {pair.before: pair.probability for pair in sobol.neighbours}
    return tuple(
        f"{place}. {sobol.sources[at]}: total index {sobol.total[at]:.3f} "
        f"({interval[0, at]:.3f}…{interval[1, at]:.3f}), among the first {_NAMED} with {among[at]:.0%} probability"
        f"{f', before the next one with {following[at]:.0%}' if at in following else ''}."
        for place, at in enumerate(sobol.order[:_NAMED], start=1)
    )


def _orders(results: RankingResults) -> tuple[str, ...]:
    """Return who makes the strongest orders."""
    found, sentences = results.orders, []
    for at in np.argsort(-found.deviation, kind="stable")[:_NAMED]:
        first, total = np.nan_to_num(found.first[at]), np.nan_to_num(found.total[at])
        alone = first.sum() > _MOSTLY
        share = first if alone else total
        largest = np.argsort(-share, kind="stable")[:2]
        leading = largest[share[largest] >= min(_SLIGHT, share.max())]
        names = " and ".join(f"{found.sources[source]} ({share[source]:.0%})" for source in leading)
        due = "needs several errors at once, most often"
        if alone:
            due = "is mostly due to" if share[leading].sum() > _MOSTLY else "comes from single errors, first of all"
        sentences.append(
            f"Order {found.orders[at]} of the output turn (standard deviation of the wave "
            f"{found.deviation[at]:.2g}″) {due} {names}."
        )
    return tuple(sentences)


def _rejects(results: RankingResults) -> tuple[str, ...]:
    """Return what drives the units out."""
    found, at = results.reject, int(np.argmax(results.reject.excess))
    where = f"the limit of {found.threshold:g}″" if found.is_limit else f"{found.threshold:.1f}″, the worst 5 %"
    low, high = found.lift_interval[:, at]
    return (
        f"Beyond {where} ({found.outside} of {found.units} units), {found.sources[at]} takes part most: the mean "
        f"square of its deviations is {found.lift[at]:.2f} ({low:.2f}…{high:.2f}) times that of all units.",
    )


def _beyond(results: RankingResults) -> tuple[str, ...]:
    """Return the share of units beyond the limit, and how it is known."""
    found = results.beyond
    share = found.parts_per_million
    allowed = (1 - results.target) * 1e6
    if share.estimate >= _RARE:
        numbers = f"{share.estimate / 1e4:.3g} % (95 % interval {share.low / 1e4:.3g}…{share.high / 1e4:.3g} %)"
        return (f"Beyond {found.limit:g}″: {numbers}, allowed {allowed / 1e4:.3g} %. {found.verdict}",)
    numbers = f"{share.estimate:,.3g} units of a million (95 % interval {share.low:,.2g}…{share.high:,.4g})"
    return (f"Beyond {found.limit:g}″: {numbers}, allowed {allowed:,.0f}. {found.verdict}",)


def _opening(results: RankingResults) -> str:
    """Return which zone has the least and the most room."""
    found = results.inverse
    finite = np.flatnonzero(np.isfinite(found.factor))
    kept = f"{results.target:.2%} of the random units keep {results.sample.quantile(results.target):.1f}″"
    if not finite.size:
        verdict = "no zone alone matters up to 10 times it" if found.meets else "no zone alone can meet the limit"
        return f"{kept}: {verdict}."
    at = finite[np.argmin(found.factor[finite])] if found.meets else finite[np.argmax(found.factor[finite])]
    name, factor = found.sources[at], found.factor[at]
    if found.meets:
        return f"{kept}: {name} has the least room, it may open alone to {factor:.2f} times its zone."
    return f"{kept}: {name} could repair that alone most easily, at {factor:.2f} times its zone."


def warnings(results: RankingResults) -> tuple[str, ...]:
    """Return what a reader must know before acting on the answer."""
    found = []
    if results.quick:
        found.append("Quick run: small samples, wide intervals. Run without --quick before setting a drawing.")
    if not results.sobol.growth.stable:
        found.append("The order of the first places is not settled: see the blocks that would tell neighbours apart.")
    if results.errors.is_correlated:
        found.append(
            "Some sources are correlated: Sobol indices stand for whole blocks of them, Shapley effects share the "
            "variance among their members; lift, PAWN, delta and root-sum-square do not know of the correlation, so a "
            "source that only goes along with another shows there too."
        )
    if results.reproduction.promised and results.reproduction.share < results.reproduction.confidence:
        found.append("A second seed did not show as many of the promised orders as it should: add blocks.")
    if results.spread is not SamplingDesign.MONTE_CARLO:
        found.append(
            f"The random units are spread as {results.spread.value}: intervals of yields and quantiles do not hold."
        )
    if not results.reject.is_limit:
        side = "keep" if results.beyond.estimate.probability > 0.5 else "lie outside"
        found.append(
            f"Too few units {side} the limit to say what those outside share; the worst 5 % stand in for them."
        )
    found += [f"Share beyond the limit: {caution}." for caution in results.beyond.estimate.cautions]
    found += [f"{output} is the same for all units; nothing drives it." for output in results.sobol.constant]
    if results.sobol.dropped:
        found.append(f"{results.sobol.dropped} Sobol blocks held a failed unit and were dropped whole.")
    failed = sum(count for outcome, count in results.statuses.items() if outcome != "equilibrium found")
    if failed:
        found.append(f"{failed} units have no equilibrium; no figure uses them, and yields count them as outside.")
    return tuple(found)


def assumptions(results: RankingResults) -> tuple[str, ...]:
    """Return what no source states."""
    return (
        *results.reducer.assumptions,
        "zones, distributions and Cp: as the tolerance table states them; its notes say where each comes from",
        "correlated as the section on correlated sources lists"
        if results.errors.is_correlated
        else "all sources are independent of each other",
        "the tooth modification is that of the reducer and exact; no drift, wear or temperature",
        *(
            ("identified stiffnesses: their values are exact here; tolalloc run ranks what is not known of them",)
            if results.identified
            else ()
        ),
        *(
            (f"not in the tolerance table and taken as exact: {', '.join(results.neglected)}",)
            if results.neglected
            else ()
        ),
    )


def summary(results: RankingResults) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    sobol, beyond = results.sobol.of(PEAK_TO_PEAK), results.beyond
    return {
        "study": results.name,
        "study hash": results.digest,
        "reducer": results.reducer.name,
        "torque [N·m]": results.torque,
        "limit [arcsec]": beyond.limit,
        "yield target [-]": results.target,
        "seed": results.seed,
        "quick": results.quick,
        "ranking": [
            {
                "source": sobol.sources[at],
                "total index [-]": sobol.total[at],
                "interval 90 % [-]": sobol.total_interval[:, at].tolist(),
                "first index [-]": sobol.first[at],
                "P(among first 3) [-]": sobol.among_first(min(3, len(sobol.sources)))[at],
            }
            for at in sobol.order
        ],
        "Sobol blocks [-]": results.sobol.blocks,
        "Sobol blocks dropped [-]": results.sobol.dropped,
        "samples of the Sobol analysis [-]": results.sobol.samples,
        "order of the first places is stable": results.sobol.growth.stable,
        "pairs promised [-]": results.reproduction.promised,
        "pairs a second seed shows [-]": results.reproduction.reproduced,
        "requirements": limit_tables.capability_table(results).replace({np.nan: None}).to_dict("records"),
        "probability beyond the limit [-]": beyond.estimate.probability,
        "yield [-]": beyond.interval.estimate,
        "yield interval 95 % [-]": [beyond.interval.low, beyond.interval.high],
        "surrogate": results.choice.reason,
        "statuses": dict(results.statuses),
        "warnings": list(warnings(results)),
    }


def ranking_document(results: RankingResults) -> Document:
    """Return the report."""
    return Document(
        title=f"What drives {results.reducer.name}: {results.name}",
        subtitle=f"{len(results.errors.active)} sources, {results.torque:g} N·m on the carrier, seed {results.seed}",
        answer=answer(results),
        warnings=warnings(results),
        sections=(*driver_sections(results), *limit_sections(results), *trust_sections(results)),
        assumptions=assumptions(results),
        summary=summary(results),
        seed=results.seed,
    )
