"""What a ranking says in words and numbers: sentences, warnings, assumptions and summary."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tolalloc.drawings.seeds import SamplingDesign
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.wording import QUICK_RUN, quantity, sign_of
from tolalloc.sensitivity.sobol import SobolIndices

if TYPE_CHECKING:
    from tolalloc.sensitivity.answer import RankingAnswer

_RARE = 1000.0
"""Units of a million from which a share is said in percent [-]."""
_SLIGHT = 0.05
"""Share of a wave's variance below which a second source is not named for it [-]."""
_MOSTLY = 0.5
"""Share of a wave's variance from single sources above which they are named for it [-]."""
_NAMED = 3
"""Sources that the answer names [-]."""


def sentences(answer: RankingAnswer) -> tuple[str, ...]:
    """Return the answer in sentences."""
    return (
        *_drivers(answer.dimensions or answer.indices),
        answer.sobol.convergence.status,
        *_reproduced(answer),
        *_orders(answer),
        *_uncertain(answer),
        *_rejects(answer),
        *_beyond(answer),
        _opening(answer),
        answer.choice.reason,
        *portrait_of(answer.model).remarks,
    )


def _reproduced(answer: RankingAnswer) -> tuple[str, ...]:
    """Return what a second seed made of the promised orders, if any was promised."""
    found = answer.replication
    if not found.promised:
        return ()
    return (
        f"A second seed shows {found.reproduced} of the {found.promised} pairs whose order was promised with "
        f"{found.confidence:.0%} confidence ({found.share:.1%} of them).",
    )


def _drivers(sobol: SobolIndices) -> tuple[str, ...]:
    """Return who drives the leading output, and how sure each place is."""
    interval, among = sobol.total_interval, sobol.among_first(min(_NAMED, len(sobol.sources)))
    following = {pair.before: pair.probability for pair in sobol.neighbours}
    return tuple(
        f"{place}. {sobol.sources[at]} has a part in {sobol.total[at]:.0%} of the variance (total index "
        f"{sobol.total[at]:.3f}, {interval[0, at]:.3f}…{interval[1, at]:.3f}), among the first {_NAMED} with "
        f"{among[at]:.0%} probability"
        f"{f', before the next one with {following[at]:.0%}' if at in following else ''}."
        for place, at in enumerate(sobol.order[:_NAMED], start=1)
    )


def _orders(answer: RankingAnswer) -> tuple[str, ...]:
    """Return who makes the strongest orders."""
    if answer.orders is None:
        return ()
    found, said = answer.orders, []
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
        said.append(
            f"Order {found.orders[at]} of the output turn (standard deviation of the wave "
            f"{found.deviation[at]:.2g}{sign_of(answer.wave_unit)}) {due} {names}."
        )
    return tuple(said)


def _uncertain(answer: RankingAnswer) -> tuple[str, ...]:
    """Return what not knowing the model itself does, if anything is not known."""
    if answer.effect is None:
        return ()
    effect, first_order, sign = answer.effect, answer.effect.first_order, answer.sign
    names = " + ".join(source.name for source in effect.sources)
    return (
        f"Not knowing {names} gives one unit's {answer.spoken} σ = {effect.sigma:.2g}{sign} and the mean of all units "
        f"σ = {effect.sigma_of_mean:.2g}{sign}; it moves all units together and is part of no yield. On "
        f"{first_order.units} units at {first_order.changes} joint changes of 2σ its first order is off by "
        f"{first_order.root_mean_square:.2g}{sign} root-mean-square and {first_order.largest:.2g}{sign} at most, where "
        f"the changes do {first_order.effect:.2g}{sign}.",
    )


def _limit(answer: RankingAnswer) -> str:
    """Return what a sentence calls the limits as a thing."""
    limits = answer.limits[answer.leading]
    if limits.lower is None:
        return f"the limit of {answer.limit_spoken}"
    return answer.limit_spoken if limits.upper is None else f"the limits of {answer.limit_spoken}"


def _turned(answer: RankingAnswer, value: float) -> str:
    """Return a value of the one-sided output in words."""
    read = answer.one_sided.read(value)
    if answer.limits[answer.leading].width is None:
        return f"{read:{_digits(answer)}}{answer.sign}"
    return f"{abs(read):{_digits(answer)}}{answer.sign} {'beyond' if read > 0 else 'inside'} the limits"


def _digits(answer: RankingAnswer) -> str:
    """Return the format of a value, a tenth where a hundredth of the spread is not said anyway."""
    return ".1f" if float(np.ptp(answer.sample.values)) > 1.0 else ".3g"


def _rejects(answer: RankingAnswer) -> tuple[str, ...]:
    """Return what drives the units out."""
    found, at = answer.reject, int(np.argmax(answer.reject.excess))
    where = _limit(answer) if found.is_limit else f"{_turned(answer, found.threshold)}, the worst 5 %"
    low, high = found.lift_interval[:, at]
    return (
        f"Beyond {where} ({found.outside} of {found.units} units), {found.sources[at]} takes part most: the mean "
        f"square of its deviations is {found.lift[at]:.2f} ({low:.2f}…{high:.2f}) times that of all units.",
    )


def _beyond(answer: RankingAnswer) -> tuple[str, ...]:
    """Return the share of units beyond the limit, and how it is known."""
    found = answer.beyond
    share = found.parts_per_million
    allowed = (1 - answer.target) * 1e6
    if share.estimate >= _RARE:
        numbers = f"{share.estimate / 1e4:.3g} % (95 % interval {share.low / 1e4:.3g}…{share.high / 1e4:.3g} %)"
        return (f"Beyond {answer.limit_spoken}: {numbers}, allowed {allowed / 1e4:.3g} %. {found.verdict}",)
    numbers = f"{share.estimate:,.3g} units of a million (95 % interval {share.low:,.2g}…{share.high:,.4g})"
    return (f"Beyond {answer.limit_spoken}: {numbers}, allowed {allowed:,.0f}. {found.verdict}",)


def _opening(answer: RankingAnswer) -> str:
    """Return which zone has the least and the most room."""
    found = answer.inverse
    finite = np.flatnonzero(np.isfinite(found.factor))
    quantile = answer.one_sided.of_sample(answer.sample).quantile(answer.target)
    kept = f"{answer.target:.2%} of the random units keep {_turned(answer, quantile)}"
    if not finite.size:
        verdict = "no zone alone matters up to 10 times it" if found.meets else "no zone alone can meet the limit"
        return f"{kept}: {verdict}."
    at = finite[np.argmin(found.factor[finite])] if found.meets else finite[np.argmax(found.factor[finite])]
    name, factor = found.sources[at], found.factor[at]
    if found.meets:
        return f"{kept}: {name} has the least room, it may open alone to {factor:.2f} times its zone."
    return f"{kept}: {name} could repair that alone most easily, at {factor:.2f} times its zone."


def warnings(answer: RankingAnswer) -> tuple[str, ...]:
    """Return what a reader must know before acting on the answer."""
    found = []
    if answer.header.quick:
        found.append(QUICK_RUN)
    if not answer.sobol.convergence.stable:
        found.append("The order of the first places is not settled: see the blocks that would tell neighbours apart.")
    if answer.errors.is_correlated:
        found.append(
            "Some sources are correlated: Sobol indices stand for whole blocks of them, Shapley effects share the "
            "variance among their members; lift, PAWN, delta and root-sum-square do not know of the correlation, so a "
            "source that only goes along with another shows there too."
        )
    if answer.replication.promised and answer.replication.share < answer.replication.confidence:
        found.append("A second seed did not show as many of the promised orders as it should: add blocks.")
    if answer.design is not SamplingDesign.MONTE_CARLO:
        found.append(
            f"The random units are spread as {answer.design.value}: intervals of yields and quantiles do not hold."
        )
    if not answer.reject.is_limit:
        side = "keep" if answer.beyond.estimate.probability > 0.5 else "lie outside"
        found.append(
            f"Too few units {side} the limit to say what those outside share; the worst 5 % stand in for them."
        )
    found += [f"Share beyond the limit: {caution}." for caution in answer.beyond.estimate.cautions]
    found += [f"{output} is the same for all units; nothing drives it." for output in answer.sobol.constant]
    if answer.sobol.dropped:
        found.append(f"{answer.sobol.dropped} Sobol blocks held a failed unit and were dropped whole.")
    if answer.effect and answer.effect.first_order.fails:
        error = answer.effect.first_order
        found.append(
            f"The share of {' + '.join(source.name for source in answer.effect.sources)} is rough: at 2σ its first "
            f"order is off by {error.root_mean_square:.2g}{answer.sign} where the effect is "
            f"{error.effect:.2g}{answer.sign}."
        )
    found += portrait_of(answer.model).cautions(np.array([setting.value for setting in answer.model.settings]))
    failed = answer.header.failed
    if failed:
        found.append(f"{failed} units have no answer; no figure uses them, and yields count them as outside.")
    return tuple(found)


def assumptions(answer: RankingAnswer) -> tuple[str, ...]:
    """Return what no source states."""
    settings = " and ".join(quantity(setting.name) for setting in answer.model.settings)
    return (
        *answer.header.assumptions,
        "zones, distributions and Cp: as the tolerance table states them; its notes say where each comes from",
        "correlated as the section on correlated sources lists"
        if answer.errors.is_correlated
        else "all sources are independent of each other",
        *((f"{settings} are as they stand and exact",) if settings else ()),
        "no drift, wear or temperature",
        *(
            f"{source.name}: jointly normal, taken to first order, and common to all units; part of the Sobol "
            "indices alone, not of yields, zones or hand estimates"
            for source in answer.model.uncertain
        ),
    )


def summary(answer: RankingAnswer) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    sobol, beyond, limits = answer.indices, answer.beyond, answer.limits[answer.leading]
    sides = (("", limits.upper), ("lower ", limits.lower))
    return {
        "study": answer.header.name,
        "study hash": answer.header.digest,
        portrait_of(answer.model).kind: answer.header.model,
        **answer.header.conditions,
        **{f"{side}limit [{answer.unit}]": limit for side, limit in sides if limit is not None},
        "yield target [-]": answer.target,
        "seed": answer.header.seed,
        "quick": answer.header.quick,
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
        "Sobol blocks [-]": answer.sobol.blocks,
        "Sobol blocks dropped [-]": answer.sobol.dropped,
        "samples of the Sobol analysis [-]": answer.sobol.samples,
        "order of the first places is stable": answer.sobol.convergence.stable,
        "pairs promised [-]": answer.replication.promised,
        "pairs a second seed shows [-]": answer.replication.reproduced,
        "requirements": answer.requirements.replace({np.nan: None}).to_dict("records"),
        "probability beyond the limit [-]": beyond.estimate.probability,
        "yield [-]": beyond.interval.estimate,
        "yield interval 95 % [-]": [beyond.interval.low, beyond.interval.high],
        "surrogate": answer.choice.reason,
        **({portrait_of(answer.model).uncertain_name: _effect(answer)} if answer.effect else {}),
        "statuses": dict(answer.header.statuses),
        "warnings": list(answer.warnings),
    }


def _effect(answer: RankingAnswer) -> dict[str, Any] | None:
    """Return what not knowing the model does, for a program."""
    if answer.effect is None:
        return None
    names = [source.name for source in answer.effect.sources]
    total = sum(float(answer.indices.total[answer.indices.sources.index(name)]) for name in names)
    return answer.effect.summary(total, answer.unit)
