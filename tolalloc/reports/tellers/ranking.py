"""What is said of a ranking: what drives a model's outputs, and how sure that is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tolalloc.drawings.seeds import SamplingDesign
from tolalloc.drawings.tolerance_table import table_frame
from tolalloc.reading.units import unit_of
from tolalloc.reports.document import Section
from tolalloc.reports.finished_run import told_yields
from tolalloc.reports.portrait import Portrait, portrait_of
from tolalloc.reports.teller import Teller
from tolalloc.reports.tellers import ranking_figures as figures
from tolalloc.reports.tellers import ranking_tables as tables
from tolalloc.reports.tellers.check import few_parts, interval_gaps
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import QUICK_RUN, alike, enumerated, number, quantity, sign_of, with_unit
from tolalloc.sensitivity.ranking import Convergence, Neighbours
from tolalloc.sensitivity.result import RankingResult
from tolalloc.sensitivity.saltelli import FEWEST_SHOWING
from tolalloc.sensitivity.sobol import OTHERS, SobolAnalysis, SourceIndices
from tolalloc.sensitivity.surrogate.validation import Choice

if TYPE_CHECKING:
    import pandas as pd

_RARE = 1000.0
"""Units of a million from which a share is said in percent [-]."""
_SLIGHT = 0.05
"""Share of a variance below which a further source is not named for it [-]."""
_NEGLIGIBLE = 1e-3
"""End of an interval over the estimate below which it is 0 [-]."""
_MOSTLY = 0.5
"""Share of a wave's variance from single sources above which they are named for it [-]."""
_SURE = 0.995
"""Confidence that would be rounded to certainty [-]."""
_TOO_CLOSE = 0.6
"""Share of resamples below which one source is not said to rank above the next [-]."""
_CARRIED = 0.99
"""Width of intervals over that without a control variate below which it is worth a sentence [-]."""
_LEAST_CARRIED = 0.01
"""The same below which it has no digit to print [-]."""
_NAMED = 3
"""Sources that the answer names [-]."""
_NOTHING = 0.005
"""Share that is written as 0 % [-]."""
_AS_STRONG = 0.9
"""Share of the largest change per micrometre from which a source is as strong as any [-]."""
_say = Sentences("ranking")


class RankingTeller(Teller[RankingResult]):
    """What is said of a ranking."""

    shown: ClassVar[tuple[str, ...]] = (
        *("dimension", "source", "contribution [%]", "total index ST [-]", "ST low 5 % [-]", "ST high 95 % [-]"),
    )

    @property
    def title(self) -> str:
        """Which model, in which study."""
        return _say("title", asked=self.header.asked)

    @property
    def subtitle(self) -> str:
        """Sources, conditions and seed."""
        conditions = (super().subtitle,) if self.header.conditions else ()
        count = _say("subtitle_sources", count=len(self.result.errors.active))
        return ", ".join((count, *conditions, _say("subtitle_seed", seed=self.header.seed)))

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """Who drives the leading output, each order and the units out of the limits."""
        found = self.result
        return (
            *self._led(),
            *self._centre(),
            *_drivers(found.indices),
            *self._others(),
            *self._of_other_limits(),
            *_unseen(found.sobol, found.leading),
            *self._per_micrometre(),
            converged(found.sobol.convergence, quantity(found.sobol.followed[0])),
            *self._orders(),
            *self._uncertain(),
            self._rejects(),
            self._beyond(),
            *self._all_limits(),
            *few_parts(self.result.joint),
            self._opening(),
            chosen_surrogate(found.choice),
            *self._portrait.remarks,
            *self._portrait.risks,
        )

    @property
    def before(self) -> tuple[str, ...]:
        """What moving one nominal brings, which costs nothing."""
        return tuple(self._centre())

    @property
    def headline(self) -> tuple[str, ...]:
        """The first drivers, in one sentence; those of the limit that the study states first in another one."""
        found, first = self.result, self.result.first_limited
        drivers = [_named_drivers(found.indices, self._output)]
        if first != found.leading and first not in found.sobol.constant:
            drivers.append(_named_drivers(found.sobol.of(first), self._portrait.display_name(first)))
        return (*self._led(), *self._centre(), *drivers)

    @cached_property
    def _portrait(self) -> Portrait[Any]:
        """Words and pictures of the model."""
        return portrait_of(self.result.model)

    @property
    def _output(self) -> str:
        """What a sentence calls the leading output."""
        return self._portrait.display_name(self.result.leading)

    @property
    def _unit(self) -> str:
        """Unit of the leading output."""
        return unit_of(self.result.leading)

    @property
    def _sign(self) -> str:
        """What follows a number of the leading output."""
        return sign_of(self._unit)

    def _told(self, key: str, **gaps: Any) -> str:
        """Return a sentence with gaps that many have: result, leading output, its sign, what units are called."""
        common = {"result": self.result, "output": self._output, "sign": self._sign}
        return _say(key, **{**common, "simulated": self._portrait.simulated, **gaps})

    def _written(self, name: str) -> str:
        """Return what a user's table calls a source, or its name."""
        return next((own.own_id for own in self.result.errors.active if own.name == name and own.own_id), name)

    @property
    def _limits(self) -> str:
        """What a sentence calls the limits of the leading output."""
        limits = self.result.limits[self.result.leading]
        side = "upper" if limits.lower is None else "lower" if limits.upper is None else "both"
        limit = limits.upper if limits.lower is None else limits.lower
        return self._told(f"limit_{side}", limit=limit, upper=limits.upper)

    @property
    def _the_limits(self) -> str:
        """What a sentence calls the limits as a thing."""
        upper_alone = self.result.limits[self.result.leading].lower is None
        return _say("the_limit", limit=self._limits) if upper_alone else self._limits

    def _turned(self, value: float) -> str:
        """Return a value of the one-sided output in words, a tenth where a hundredth of the spread is not said."""
        digits = ".1f" if float(np.ptp(self.result.sample.values)) > 1.0 else ".3g"
        read = self.result.one_sided.read(value)
        if self.result.limits[self.result.leading].width is None:
            return f"{number(read, digits)}{self._sign}"
        return self._told("value_beyond" if read > 0 else "value_inside", value=number(abs(read), digits))

    def _led(self) -> Iterator[str]:
        """Yield why another limit leads than the first one, if one does."""
        first, leading = self.result.first_limited, self.result.leading
        if first != leading:
            miss, miss_first = (1 - self.result.yields[name].estimate for name in (leading, first))
            gaps = {"output": self._output.capitalize(), "first": self._portrait.display_name(first)}
            decides = self._portrait.display_name(leading)
            yield self._told("led", miss=miss, miss_first=miss_first, decides=decides, **gaps)

    def _centre(self) -> Iterator[str]:
        """Yield what moving one nominal brings; nothing where the mean is in the middle."""
        found = self.result.centring
        if found is None:
            return
        moved = next(own for own in self.result.errors.active if own.name == found.source)
        capability = next(own.capability for own in self.result.capabilities if own.output == self.result.leading)
        yield self._told(
            "centre",
            off=f"{number(abs(found.off), '.3g')}{self._sign}",
            side=_say("above" if found.off > 0 else "below"),
            pp=capability.pp if capability else np.nan,
            ppk=capability.ppk if capability else np.nan,
            source=self._written(found.source),
            shift=with_unit(f"{found.shift / moved.unit_length:+.2g}", f"[{moved.unit}]"),
        )

    def _of_other_limits(self) -> Iterator[str]:
        """Yield what drives every other output that a study limits, in a line each."""
        sobol, own = self.result.sobol, self.result.model.own_limits
        for output in list(self.result.limits)[1:]:
            if output not in sobol.constant and output not in own:
                yield _named_drivers(sobol.of(output), self._portrait.display_name(output))

    def _others(self) -> Iterator[str]:
        """Yield what all those do together that further blocks did not tell apart."""
        sobol = self.result.sobol
        if sobol.together is None:
            return
        at = sobol.together.sources.index(OTHERS)
        low, high = sobol.together.total_interval[:, at]
        total, count = min(sobol.together.total[at], 1.0), len(sobol.small)
        yield self._told("others", count=count, total=total, low=100 * low, high=high)

    def _per_micrometre(self) -> Iterator[str]:
        """Yield the order per micrometre, and why it is not that of the ranking, if a zone weighs in it."""
        indices, changes = self.result.indices, tables.per_micrometre(self.result)
        ranked = [indices.sources[at] for at in indices.order if indices.sources[at] in changes]
        if not ranked:
            return
        first = sorted(changes.items(), key=lambda own: -own[1])
        zones = {name: own[0].said(own[0].zone) for name, own in self.result.members.items() if own}
        names = ", ".join(self._told("per_micrometre_name", source=own, change=at) for own, at in first[:_NAMED])
        key = "same" if changes[ranked[0]] >= _AS_STRONG * first[0][1] else "other"
        gaps = {
            "driver": ranked[0],
            "zone": zones[ranked[0]],
            "first": first[0][0],
            "zone_of_first": zones[first[0][0]],
        }
        yield _say(f"per_micrometre_{key}", names=names, **gaps)

    def _orders(self) -> Iterator[str]:
        """Yield who makes the strongest orders."""
        found = self.result.orders
        if found is None:
            return
        for at in np.argsort(-found.deviation, kind="stable")[:_NAMED]:
            first, total = np.nan_to_num(found.first[at]), np.nan_to_num(found.total[at])
            alone = first.sum() > _MOSTLY
            share = first if alone else total
            largest = np.argsort(-share, kind="stable")[:2]
            leading = largest[share[largest] >= min(_SLIGHT, share.max())]
            due = "order_together"
            if alone:
                due = "order_alone" if share[leading].sum() > _MOSTLY else "order_several"
            names = " and ".join(
                _say("order_name", source=found.sources[source], share=min(share[source], 1.0)) for source in leading
            )
            wave = {"deviation": found.deviation[at], "sign": sign_of(tables.wave_unit(self.result))}
            yield _say("order", order=found.orders[at], due=_say(due), names=names, **wave)

    def _uncertain(self) -> Iterator[str]:
        """Yield what not knowing the model itself does, if anything is not known."""
        if effect := self.result.effect:
            names = " + ".join(source.name for source in effect.sources)
            yield self._told("uncertain", names=names, effect=effect, error=effect.first_order)

    def _rejects(self) -> str:
        """Return what drives the units out."""
        found, at = self.result.reject, int(np.argmax(self.result.reject.excess))
        low, high = found.lift_interval[:, at]
        where = self._the_limits if found.is_limit else _say("worst_share", value=self._turned(found.threshold))
        gaps = {"source": self._written(found.sources[at]), "lift": found.lift[at], "low": low, "high": high}
        return self._told("rejects" if low > 1.0 else "rejects_alike", where=where, **gaps)

    def _beyond(self) -> str:
        """Return the share of units beyond the limit, and how it is known."""
        found = self.result.beyond
        share = found.parts_per_million
        allowed = (1 - self.result.target) * 1e6
        if share.estimate >= _RARE:
            key, scale = "beyond_share", 1e4
            shown, low, high = alike(*(own / scale for own in (share.estimate, share.low, share.high)), most=100.0)
        else:
            key, scale = "beyond_rare", 1.0
            least = share.low if share.low > _NEGLIGIBLE * share.estimate else 0.0
            shown, low, high = number(share.estimate, ",.3g"), number(least, ",.3g"), number(share.high, ",.0f")
        return self._told(key, limit=self._limits, share=shown, low=low, high=high, allowed=allowed / scale)

    def _all_limits(self) -> Iterator[str]:
        """Yield the share of units that keep all limits at once, where there are several."""
        if len(self.result.limits) > 1:
            yield self._told("all_limits", **interval_gaps(self.result.joint))

    def _opening(self) -> str:
        """Return which zone has the least and the most room."""
        found, target = self.result.inverse, self.result.target
        finite = np.flatnonzero(np.isfinite(found.factor))
        quantile = self.result.one_sided.of_sample(self.result.sample).quantile(target)
        if finite.size:
            at = finite[np.argmin(found.factor[finite])] if found.meets else finite[np.argmax(found.factor[finite])]
            key = "opening_least" if found.meets else "opening_easiest"
            opening = _say(key, source=self._written(found.sources[at]), factor=found.factor[at])
        else:
            missing = "opening_any" if found.meets else "opening_none"
            opening = _say(missing if found.decided else "opening_undecided", units=found.units)
        limits = self.result.limits[self.result.leading]
        key = "kept_upper" if limits.lower is None else "kept_lower"
        if limits.width is not None:
            key = "kept_beyond" if self.result.one_sided.read(quantile) > 0 else "kept_inside"
        return self._told(key, value=self._turned(quantile), opening=opening)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on the answer."""
        return tuple(self._warnings())

    def _warnings(self) -> Iterator[str]:
        result = self.result
        if self.header.quick:
            yield QUICK_RUN
        if not result.sobol.convergence.stable:
            yield _say("unsettled")
        if result.errors.is_correlated:
            yield _say("correlated")
        if result.design is not SamplingDesign.MONTE_CARLO:
            yield _say("spread", design=result.design.value)
        if not result.reject.is_limit:
            yield _say("few_keep" if result.beyond.estimate.probability > 0.5 else "few_outside")
        yield from (_say("caution", caution=caution) for caution in result.beyond.estimate.cautions)
        yield from (_say("constant", output=output) for output in result.sobol.constant)
        if result.sobol.dropped:
            yield _say("dropped", blocks=result.sobol.dropped)
        if result.effect and result.effect.first_order.fails:
            names = " + ".join(source.name for source in result.effect.sources)
            yield self._told("rough", names=names, error=result.effect.first_order)
        values = np.array([setting.value for setting in result.model.settings])
        yield from (_say("present", caution=own) if values.size else own for own in self._portrait.cautions(values))
        if self.header.failed:
            yield _say("failed", units=self.header.failed)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        model = self.result.model
        settings = [quantity(setting.name) for setting in model.settings]
        return (
            *self.header.assumptions,
            _say("as_stated"),
            _say("correlations" if self.result.errors.is_correlated else "independent"),
            *((_say("settings", names=enumerated(settings)),) if settings else ()),
            _say("no_drift"),
            *(_say("first_order", source=source.name) for source in model.uncertain),
        )

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Drivers, limits, and what the answer rests on."""
        behind = self.standing(self._limit_sections, self._trust_sections)
        return (*self.standing(self._driver_sections), *(replace(own, folded=True) for own in behind))

    @cached_property
    def _requirements(self) -> pd.DataFrame:
        return tables.capability_table(self.result)

    def _driver_sections(self) -> Iterator[Section]:
        """Yield which error drives what: the leading output, all requirements, each order."""
        result = self.result
        pairs = tables.pairs_table(result.indices, result.by)
        yield Section(
            heading=_say("drivers_heading", output=self._output),
            paragraphs=(_say("drivers", carried=_carried(result.sobol.narrowed(0))),),
            figures=(figures.ranking_figure(result),),
            tables=(
                ("ranking", tables.ranking_table(result)),
                *(((pairs.name, pairs.frame()),) if pairs.rows else ()),
                ("convergence", tables.convergence_table(result)),
            ),
        )
        if any(len(own) > 1 for own in result.members.values()):
            yield Section(
                heading=_say("dimensions_heading", output=self._output),
                paragraphs=(_say("dimensions"),),
                tables=(("dimensions", tables.dimensions_table(result)),),
                unfolded=True,
                first=True,
                folded=True,
            )
        if result.shapley is not None:
            yield Section(
                heading=_say("correlated_heading"),
                paragraphs=result.errors.correlation.mappings(result.errors.sources),
                tables=(("Shapley effects", tables.shapley_table(result.shapley)),),
            )
        names = ", ".join(quantity(name) for name in result.sobol.ranked)
        yield Section(
            heading=_say("overall_heading"),
            paragraphs=(self._told("overall", outputs=names),),
            figures=(figures.requirements_figure(result),),
            tables=(("all requirements", tables.overall_table(result)),),
            folded=True,
        )
        if result.orders is not None:
            note = f"{self._portrait.spectra_note}. " if self._portrait.spectra_note else ""
            yield Section(
                heading=_say("orders_heading"),
                paragraphs=(f"{note}{self._told('orders')}",),
                figures=(figures.orders_figure(result),),
                tables=(("orders", tables.orders_table(result)),),
                folded=True,
            )
        unit = result.sample.unit_at(0.5)[0]
        yield from self._portrait.moving(result.errors, unit, result.share_of_source, "median unit")

    def _limit_sections(self) -> Iterator[Section]:
        """Yield what the limits do: yield, units beyond them, and how far each zone may open."""
        result = self.result
        yield Section(
            heading=_say("yield_heading"),
            figures=(figures.sample_figure(result),),
            tables=(
                ("requirements", self._requirements),
                ("beyond the limit", tables.beyond_table(result)),
                ("stack-up", tables.stack_up_table(result, f"{self._output} [{self._unit}]")),
            ),
        )
        yield Section(
            heading=_say("rejects_heading"),
            figures=(figures.reject_figure(result),),
            tables=(("rejects", tables.reject_table(result.reject)),),
        )
        yield Section(
            heading=_say("alone_heading"),
            paragraphs=(_say("alone_others", output=quantity(result.leading)),) if len(result.limits) > 1 else (),
            figures=tuple(figures.inverse_figures(result)),
            tables=(("alone", tables.inverse_table(result)),),
        )

    def _trust_sections(self) -> Iterator[Section]:
        """Yield what the answer rests on: other measures, surrogates, distributions, work done."""
        result = self.result
        statuses = self.header.statuses.items()
        yield Section(heading=_say("measures_heading"), tables=(("measures", tables.measures_table(result)),))
        yield Section(
            heading=_say("surrogates_heading"),
            tables=(("surrogates", tables.surrogate_table(result.choice)),),
        )
        yield Section(
            heading=_say("mapping_heading"),
            tables=(
                ("mapping", tables.mapping_table(result)),
                *tables.measured_tables(result),
                ("tolerances", table_frame(result.errors.sources, cost_unit=self.header.cost_unit)),
            ),
        )
        yield Section(
            heading=_say("work_heading"),
            paragraphs=(", ".join(_say("work", units=count, outcome=outcome) for outcome, count in statuses if count),),
            tables=(("work", tables.work_table(self.header)),),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        result, header, sobol = self.result, self.header, self.result.sobol
        beyond, limits = result.beyond, result.limits[result.leading]
        sides = (("", limits.upper), ("lower ", limits.lower))
        return {
            "study": header.name,
            "study hash": header.digest,
            self._portrait.kind: header.model,
            **header.conditions,
            **{f"{side}limit [{self._unit}]": limit for side, limit in sides if limit is not None},
            "yield target [-]": result.target,
            "seed": header.seed,
            "quick": header.quick,
            "ranking": tables.ranked(result.indices, result.by),
            "Sobol blocks [-]": sobol.blocks,
            "Sobol blocks dropped [-]": sobol.dropped,
            "samples of the Sobol analysis [-]": sobol.samples,
            "order of the first places is stable": sobol.convergence.stable,
            "requirements": self._requirements.replace({np.nan: None}).to_dict("records"),
            "probability beyond the limit [-]": beyond.estimate.probability,
            "yield [-]": beyond.interval.estimate,
            "yield interval 95 % [-]": [beyond.interval.low, beyond.interval.high],
            **told_yields(result.yields, result.joint),
            "surrogate": chosen_surrogate(result.choice),
            **({self._portrait.uncertain_name: self._effect()} if result.effect else {}),
            "statuses": dict(header.statuses),
            "warnings": list(self.warnings),
        }

    def _effect(self) -> dict[str, Any]:
        """Return what not knowing the model does, for a program."""
        effect, indices, unit = self.result.effect, self.result.indices, self._unit
        assert effect is not None
        names, error = [source.name for source in effect.sources], effect.first_order
        return {
            "source": " + ".join(names),
            "total index ST [-]": sum(float(indices.total[indices.sources.index(name)]) for name in names),
            f"sigma of a unit [{unit}]": effect.sigma,
            f"sigma of the mean [{unit}]": effect.sigma_of_mean,
            f"first-order error at 2 sigma, rms [{unit}]": error.root_mean_square,
            f"first-order error at 2 sigma, largest [{unit}]": error.largest,
            f"effect at 2 sigma, rms [{unit}]": error.effect,
        }


def _carried(narrowed: float) -> str:
    """Return how much narrower a control variate makes intervals, nothing where it does not."""
    if narrowed >= _CARRIED:
        return ""
    return " " + _say("carried", narrowed=f"{narrowed:.2f}" if narrowed >= _LEAST_CARRIED else "less than 0.01")


def _first_named(sobol: SourceIndices) -> list[int]:
    """Return the positions of the first places, without those of which the end of the interval is written as 0 %."""
    first, *others = sobol.order[:_NAMED]
    return [first, *(at for at in others if sobol.total_interval[1][at] >= _NOTHING)]


def _drivers(sobol: SourceIndices) -> Iterator[str]:
    """Yield who drives the leading output, and how sure each place is."""
    low, high = sobol.total_interval
    following = {pair.before: pair for pair in sobol.neighbours}
    for place, at in enumerate(_first_named(sobol), start=1):
        share = {"total": min(sobol.total[at], 1.0), "low": low[at], "high": high[at]}
        before = f" {_before(following[at], sobol.sources)}" if at in following else ""
        yield _say("driver", place=place, source=sobol.sources[at], before=before, **share)


def _unseen(sobol: SobolAnalysis, output: str) -> Iterator[str]:
    """Yield of which errors too few blocks show enough to say how much they do."""
    found = sobol.of(output)
    for blocks, few in ((sobol.blocks, False), (sobol.first_blocks, True)):
        names = [found.sources[at] for at in np.flatnonzero(found.unseen > _SLIGHT) if (int(at) in found.few) is few]
        if names:
            yield _say("unseen", blocks=blocks, fewest=FEWEST_SHOWING, names=", ".join(names))


def _named_drivers(sobol: SourceIndices, output: str) -> str:
    """Return the same of all of them in one sentence, without the places."""
    low, high = sobol.total_interval
    named = []
    for at in _first_named(sobol):
        share = {"total": min(sobol.total[at], 1.0), "low": 100 * low[at], "high": high[at]}
        named.append(_say("driver_short", source=sobol.sources[at], **share))
    return _say("drivers_short", output=output, names=", ".join(named))


def _before(pair: Neighbours, sources: Sequence[str]) -> str:
    """Return how sure it is that a source ranks above the next one."""
    key = "driver_surely" if pair.probability >= _SURE else "driver_before"
    if pair.probability < _TOO_CLOSE:
        key = "driver_close"
    return _say(key, next=sources[pair.after], probability=pair.probability)


def converged(found: Convergence, output: str) -> str:
    """Return whether the order of the first places is stable."""
    last = found.history[-1]
    verdict = _say("converged" if found.stable else "not_converged")
    return _say(
        "convergence", output=output, count=len(last.first), verdict=verdict, last=last, asked=found.probability
    )


def chosen_surrogate(choice: Choice) -> str:
    """Return which surrogate is used and why."""
    score = choice.scores[choice.best]
    if choice.chosen is None:
        return _say("surrogate_none", name=score.name, shortfalls="; ".join(tables.shortfalls(score)))
    untried = f" {_say('surrogate_untried', names=', '.join(choice.untried))}" if choice.untried else ""
    off = {"quantile": tables.quantile_name(score), "error": abs(score.quantile_share)}
    return _say("surrogate", score=score, untried=untried, **off)


TELLER = RankingTeller
