"""The tables of a ranking: who drives what, what the limits do, and what the answer rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float, Num

from tolalloc.drawings.sources import Source, zone_in, zone_unit
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.columns import Column, Table, of_positions, own_words, span
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity
from tolalloc.sensitivity.derivatives import LineDerivatives
from tolalloc.sensitivity.inverse import InverseSensitivity
from tolalloc.sensitivity.ranking import Neighbours
from tolalloc.sensitivity.result import RankingResult
from tolalloc.sensitivity.shapley import ShapleyEffects
from tolalloc.sensitivity.sobol import SourceIndices
from tolalloc.sensitivity.surrogate.regression import NEEDED_Q2
from tolalloc.sensitivity.surrogate.validation import LARGEST_FAILED_SHARE, LARGEST_QUANTILE_ERROR, Choice, Score
from tolalloc.sensitivity.target import TargetSensitivity

_say = Sentences("ranking")
_ALIKE = 9
"""Decimals of a value over the largest one to which equal ones are alike, so that no last digit orders them [-]."""


def largest_first(values: Sequence[float] | np.ndarray) -> list[int]:
    """Return the positions of values, largest first, equal ones in their order."""
    known = np.asarray(values, float)
    size = float(np.abs(known[np.isfinite(known)]).max(initial=0.0)) or 1.0
    return [int(at) for at in np.argsort(-np.round(known / size, _ALIKE), kind="stable")]


def _told(index: Float[np.ndarray, "*source"]) -> Float[np.ndarray, "*source"]:
    """Return indices as shares within 0 and 1, as their intervals are; chance may put an estimate beside them [-]."""
    return np.asarray(np.clip(index, 0.0, 1.0))


def _ends(name: str, interval: Num[np.ndarray, "end source"]) -> dict[str, Any]:
    """Return the columns of the ends of an interval of 90 %, under the name of what they are about."""
    return {f"{name}low 5 % [-]": interval[0], f"{name}high 95 % [-]": interval[1]}


def sobol_table(sobol: SourceIndices, named: str = "source") -> pd.DataFrame:
    """Return what is ranked, largest total Sobol index first, with intervals and the confidence of every place."""
    share = sobol.total / sobol.total.sum() * 100
    among, following = sobol.among_first(min(3, len(sobol.sources))), {pair.before: pair for pair in sobol.neighbours}
    place = {at: number for number, at in enumerate(sobol.order, start=1)}
    columns: dict[str, Any] = {
        "rank [-]": place,
        named: sobol.sources,
        "contribution [%]": share,
        "cumulative [%]": lambda at: share[sobol.order[: place[at]]].sum(),
        "total index ST [-]": _told(sobol.total),
        **_ends("ST ", sobol.total_interval),
        "first index S1 [-]": _told(sobol.first),
        **_ends("S1 ", sobol.first_interval),
        "S1 reading": [_say("zero" if is_zero else "above_zero") for is_zero in sobol.first_is_zero],
        **_ends("rank ", sobol.rank_interval),
        "P(among first 3) [%]": among * 100,
        "P(before the next) [%]": lambda at: following[at].probability * 100 if at in following else np.nan,
        "more blocks needed to separate it from the next [-]": lambda at: _blocks(following.get(at)),
    }
    return of_positions("ranking", columns, sobol.order).frame()


def _blocks(pair: Neighbours | None) -> str:
    """Return how many more Sobol blocks would tell a source from the next one."""
    if pair is None or pair.more_blocks is None:
        return ""
    return _say("told_apart") if pair.separated else _say("more_blocks", blocks=float(f"{pair.more_blocks:.2g}"))


def ranking_table(result: RankingResult) -> pd.DataFrame:
    """Return the ranking of the leading output, with the zone and the order per micrometre beside it."""
    frame = sobol_table(result.indices, result.by)
    zone, unit = zone_unit(result.errors.active), unit_of(result.leading)
    zones = {
        name: span(min(known), max(known))
        for name, own in result.members.items()
        if (known := [zone_in(source, zone) for source in own])
    }
    columns = {f"zone [{zone}]": zones, **_derivatives(result, f"rms change per µm [{unit}/µm]")}
    frame = frame.assign(
        **{header: [own.get(name, np.nan) for name in frame[result.by]] for header, own in columns.items()}
    )
    return _with_own_words(frame, result.members)


def _derivatives(result: RankingResult, head: str) -> dict[str, dict[str, Any]]:
    """Return Sens and the order per micrometre, under a head, of what is ranked, where it has any."""
    unit, lines, changes = unit_of(result.leading), _lines(result), per_micrometre(result)
    order = [[*changes][at] for at in largest_first([*changes.values()])]
    return {
        f"Sens [{unit}/µm]": {name: span(*own.slope) for name, own in lines.items()},
        head: changes,
        "rank per µm [-]": {name: rank for rank, name in enumerate(order, start=1)},
        f"rms change by its zone [{unit}]": {name: own.by_zone for name, own in lines.items()},
    }


def _with_own_words(frame: pd.DataFrame, members: Mapping[str, Sequence[Source]]) -> pd.DataFrame:
    """Return a table with own id, drawing and label of its rows behind their names, where the drawing states any."""
    named = next(own for own in ("source", "dimension") if own in frame)
    words: tuple[Column[str], ...] = own_words(lambda name: members.get(name, ()), lambda name: name)
    for own in reversed(words):
        if any(said := [own.value(name) for name in frame[named]]):
            frame.insert(list(frame.columns).index(named) + 1, own.header, said)
    return frame


def ranked(sobol: SourceIndices, named: str) -> list[dict[str, Any]]:
    """Return the ranking for a program."""
    interval, among = sobol.total_interval, sobol.among_first(min(3, len(sobol.sources)))
    columns: dict[str, Any] = {
        named: sobol.sources,
        "total index [-]": _told(sobol.total),
        "interval 90 % [-]": lambda at: interval[:, at].tolist(),
        "first index [-]": _told(sobol.first),
        "P(among first 3) [-]": among,
    }
    return of_positions("ranking", columns, sobol.order).records()


def dimensions_table(result: RankingResult) -> pd.DataFrame:
    """Return the dimensions of the drawing, largest total-effect index first, with what stands on the drawing."""
    found, unit = result.indices, unit_of(result.leading)
    low, high = found.total_interval * 100
    members = [result.members[name] for name in found.sources]
    derivatives = _derivatives(result, f"rms change per µm in every place [{unit}/µm]")
    columns: dict[str, Any] = {
        "dimension": found.sources,
        "places [-]": lambda at: len(members[at]),
        "as written [mm]": lambda at: portrait_of(result.model).frames(members[at]),
        "total-effect index [%]": _told(found.total) * 100,
        "low 5 % [%]": low,
        "high 95 % [%]": high,
        "alone (first-order index) [%]": _told(found.first) * 100,
        **{header: [own.get(name, np.nan) for name in found.sources] for header, own in derivatives.items()},
    }
    frame = of_positions("dimensions", columns, found.order).frame()
    return _with_own_words(frame, result.members)


def per_micrometre(result: RankingResult) -> dict[str, float]:
    """Return what a micrometre in every place of each of them does, root mean square [unit of the output per µm]."""
    return {name: own.per_micrometre for name, own in _lines(result).items()}


def _lines(result: RankingResult) -> dict[str, LineDerivatives]:
    """Return what a micrometre in every place of what is ranked does.

    Nothing of what is no length, or where places depend on each other.
    """
    independent = {block[0] for block in result.errors.blocks if len(block) == 1}
    known = independent & {*result.local.sources}
    names = {name: [own.name for own in members] for name, members in result.members.items()}
    return {name: result.local.of_line(own) for name, own in names.items() if own and known.issuperset(own)}


def pairs_table(sobol: SourceIndices, named: str) -> Table[int]:
    """Return what pairs add only together, the largest first; empty unless second order was asked for."""
    columns: dict[str, Any] = {
        named: [sobol.sources[one] for one, _ in sobol.pairs],
        "with": [sobol.sources[other] for _, other in sobol.pairs],
        "second index S2 [-]": _told(sobol.second),
        **_ends("S2 ", sobol.second_interval),
    }
    return of_positions("pairs", columns, largest_first(sobol.second))


def overall_table(result: RankingResult) -> pd.DataFrame:
    """Return one ranking over all outputs with a limit: the largest total index of each and where it has it."""
    overall, sobol = result.sobol.overall, result.sobol
    varying = [output for output in result.outputs if output not in sobol.constant]
    columns: dict[str, Any] = {
        "rank [-]": {at: number for number, at in enumerate(overall.order, start=1)},
        result.by: overall.sources,
        "largest ST where limited [-]": overall.total,
        **_ends("", overall.total_interval),
        **_ends("rank ", overall.rank_interval),
        "drives most": [quantity(name) for name in overall.drives],
        **{f"ST {quantity(output)} [-]": sobol.indices.total[sobol.position(output)] for output in varying},
    }
    return of_positions("all requirements", columns, overall.order).frame()


def convergence_table(result: RankingResult) -> pd.DataFrame:
    """Return how the first places settled as the blocks grew."""
    names, history = result.sobol.sources, result.sobol.convergence.history
    columns: dict[str, Any] = {
        "blocks [-]": [step.blocks for step in history],
        "first places": [", ".join(names[at] for at in step.first) for step in history],
        "share of the resamples with this order [%]": [step.probability * 100 for step in history],
    }
    return pd.DataFrame(columns)


def wave_unit(result: RankingResult) -> str:
    """Return the unit of the waves of the model's spectra."""
    return unit_of(next(iter(result.model.spectra.values()))[0])


def orders_table(result: RankingResult) -> pd.DataFrame:
    """Return what each error adds to the wave of each order, alone and with others."""
    found = result.orders
    assert found is not None
    order, source = np.array([(at, own) for at, row in enumerate(found.total) for own in largest_first(row)]).T
    columns: dict[str, Any] = {
        "order of the output turn [-]": np.array(found.orders)[order],
        f"standard deviation of the wave [{wave_unit(result)}]": found.deviation[order],
        result.by: np.array(found.sources)[source],
    }
    for name, shares, ends in (
        ("alone", found.first, found.first_interval),
        ("with others", found.total, found.total_interval),
    ):
        columns[f"share {name} [-]"] = _told(shares)[order, source]
        columns |= _ends(f"{name} ", ends[order, :, source].T)
    return pd.DataFrame(columns)


def shapley_table(found: ShapleyEffects) -> pd.DataFrame:
    """Return the Shapley effects on the leading output, the largest first."""
    columns: dict[str, Any] = {
        "source": found.sources,
        "Shapley effect [-]": _told(found.effects[0]),
        **_ends("", found.interval(0)),
        **_ends("rank ", found.rank_interval(0)),
    }
    return of_positions("Shapley effects", columns, largest_first(found.effects[0])).frame()


def capability_table(result: RankingResult) -> pd.DataFrame:
    """Return every requirement with its distribution, capability and yield."""
    rows = []
    for own in result.capabilities:
        quantile, limits, inside, able = own.quantile, own.limits, own.inside, own.capability
        row: dict[str, object] = {
            "requirement": quantity(own.output),
            "unit": unit_of(own.output),
            "Mean": own.mean,
            "Sigma": own.deviation,
            "Min": own.least,
            "Max": own.most,
            f"{result.target:.2%} quantile, low 2.5 %": quantile.low,
            f"{result.target:.2%} quantile, high 97.5 %": (
                quantile.high if np.isfinite(quantile.high) else _say("too_small")
            ),
        }
        if limits and inside:
            row |= {
                "LSL": limits.lower,
                "USL": limits.upper,
                "Yield [%]": inside.estimate * 100,
                "Yield low 2.5 % [%]": inside.low * 100,
                "Yield high 97.5 % [%]": inside.high * 100,
                "% out [%]": (1 - inside.estimate) * 100,
                "PPM [1e-6]": (1 - inside.estimate) * 1e6,
                "OK": "yes" if inside.bound >= result.target else "no",
            }
        if able:
            row |= {"Pp [-]": able.pp, "Ppk [-]": able.ppk, "PPM if normal [1e-6]": able.normal_ppm}
        rows.append(row)
    return pd.DataFrame(rows).dropna(axis="columns", how="all")


def beyond_table(result: RankingResult) -> pd.DataFrame:
    """Return the share beyond the limit by every method that was asked."""
    found = result.beyond
    rows = list(dict.fromkeys((*found.estimates, found.estimate)))
    columns: dict[str, Any] = {
        "method": [item.method for item in rows],
        "probability beyond the limit [-]": [item.probability for item in rows],
        "standard error [-]": [item.standard_error for item in rows],
        "coefficient of variation [-]": [item.coefficient_of_variation for item in rows],
        "units solved [-]": [item.calls for item in rows],
        "relied on": ["yes" if item is found.estimate else "no" for item in rows],
        "cautions": ["; ".join(item.cautions) for item in rows],
    }
    return pd.DataFrame(columns)


def stack_up_table(result: RankingResult, output: str) -> pd.DataFrame:
    """Return worst case, root-sum-square and Monte Carlo side by side, of an output with its unit."""
    sample, classical = result.sample, result.classical
    rows = (
        ("worst case", classical.worst_case, _say("worst_case")),
        ("root-sum-square", classical.root_sum_square, _say("root_sum_square")),
        ("Monte Carlo mean", float(sample.values.mean()), _say("real_model")),
        (f"Monte Carlo {result.target:.2%} quantile", sample.quantile(result.target), _say("real_model")),
    )
    return pd.DataFrame(rows, columns=["estimate", output, "assumes"])


def reject_table(found: TargetSensitivity) -> pd.DataFrame:
    """Return what the units outside have in common, the strongest source first."""
    columns: dict[str, Any] = {
        "source": found.sources,
        "excess [-]": found.excess,
        **_ends("excess ", found.excess_interval),
        "columns [-]": found.columns,
        "lift [-]": found.lift,
        **_ends("lift ", found.lift_interval),
        "target index S1 [-]": _told(found.first),
        **_ends("target S1 ", found.first_interval),
        "p-value of no effect [-]": found.p_value,
        "median of all [µm]": found.median / MICROMETRE,
        "median outside [µm]": found.median_outside / MICROMETRE,
    }
    return of_positions("rejects", columns, largest_first(found.excess)).frame()


def tightest_first(found: InverseSensitivity) -> list[int]:
    """Return the positions of sources, those first that cannot meet the limit alone, then the smallest factor."""
    return [int(at) for at in np.lexsort((found.factor, ~np.isnan(found.factor)))]


def inverse_table(result: RankingResult) -> pd.DataFrame:
    """Return how far each zone may open alone, or must close."""
    found, active = result.inverse, result.errors.active
    unit = zone_unit(active)
    columns: dict[str, Any] = {
        "source": found.sources,
        f"zone now [{unit}]": [zone_in(source, unit) for source in active],
        "factor alone [-]": found.factor,
        "factor low 5 % [-]": found.low,
        "factor high 95 % [-]": found.high,
        f"zone alone [{unit}]": [zone_in(source, unit, zone) for source, zone in zip(active, found.zone, strict=True)],
        "reading": [_reading(value) if found.decided else _say("undecided") for value in found.factor],
    }
    return of_positions("alone", columns, tightest_first(found)).frame()


def _reading(factor: float) -> str:
    """Return a factor as words."""
    if np.isnan(factor):
        return _say("cannot_meet")
    if np.isinf(factor):
        return _say("does_not_matter")
    return _say("may_open", share=factor - 1) if factor >= 1 else _say("must_close", share=1 - factor)


def measures_table(result: RankingResult) -> pd.DataFrame:
    """Return every measure of every source side by side, in the order of the ranking."""
    sobol, unit = result.indices, unit_of(result.leading)
    ranked = [(at, own) for at in sobol.order for own in result.members[sobol.sources[at]]]
    frame = pd.DataFrame({"source": [own.name for _, own in ranked]})
    frame[f"total index ST of its {result.by} [-]"] = [sobol.total[at] for at, _ in ranked]
    for header, names, values in (
        (f"Sens [{unit}/µm]", result.local.sources, result.local.slope),
        (f"alone at its limit [{unit}]", result.classical.sources, result.classical.alone),
        *((("Shapley effect [-]", shapley.sources, _told(shapley.effects[0])),) if (shapley := result.shapley) else ()),
    ):
        frame[header] = frame["source"].map(dict(zip(names, values, strict=True)))
    return frame


def quantile_name(score: Score) -> str:
    """Return which quantile of a surrogate is compared."""
    return _say("quantile", share=100 * score.target)


def shortfalls(score: Score) -> tuple[str, ...]:
    """Return what a candidate for a surrogate fails in, one phrase each; nothing if it has earned its place."""
    said = {
        "q2": _say("short_q2", q2=score.q2, needed=NEEDED_Q2),
        "quantile": _say(
            "short_quantile",
            quantile=quantile_name(score),
            error=abs(score.quantile_share),
            allowed=LARGEST_QUANTILE_ERROR,
        ),
        "failed": _say("short_failed", failed=score.failed_share, allowed=LARGEST_FAILED_SHARE),
    }
    return tuple(said[name] for name in score.shortfalls)


def surrogate_table(choice: Choice) -> pd.DataFrame:
    """Return the surrogates with their errors on units that they had not seen."""
    unit, scores = choice.output[choice.output.rindex("[") :], choice.scores
    quantile = quantile_name(scores[choice.best])
    columns: dict[str, Any] = {
        "candidate": [score.name for score in scores],
        "Q² [-]": [score.q2 for score in scores],
        f"rms error {unit}": [score.rms_error for score in scores],
        f"error of the {quantile} {unit}": [score.quantile_error for score in scores],
        f"error of the {quantile} [%]": [score.quantile_share * 100 for score in scores],
        "predictions per second [1/s]": [score.per_second for score in scores],
        "speed over the response [-]": [score.speed for score in scores],
        "trained on [-]": [score.trained for score in scores],
        "held out [-]": [score.held_out for score in scores],
        "failed [-]": [score.failed for score in scores],
        "falls short": ["; ".join(shortfalls(score)) or "nowhere" for score in scores],
    }
    return pd.DataFrame(columns)


def mapping_table(result: RankingResult) -> pd.DataFrame:
    """Return how every zone became a distribution, and where the zone comes from."""
    rows = [(source.name, source.mapping, source.note) for source in result.errors.active]
    rows += [(source.name, source.mapping, _say("not_on_drawing")) for source in result.model.uncertain]
    return pd.DataFrame(rows, columns=["source", "zone → distribution", "note of the table"])


def measured_tables(result: RankingResult) -> tuple[tuple[str, pd.DataFrame], ...]:
    """Return how the measured parts of each source were fitted, one table for all; none if no parts were measured."""
    rows = [
        (source.name, source.measured, fitted)
        for source in result.errors.active
        if source.measured
        for fitted in source.measured.fit.fits or (None,)
    ]
    columns = {
        "source": [name for name, _, _ in rows],
        "parts [-]": [own.parts for _, own, _ in rows],
        "mean [µm]": [own.fit.mean / MICROMETRE for _, own, _ in rows],
        "sigma [µm]": [own.fit.deviation / MICROMETRE for _, own, _ in rows],
        "Cp [-]": [own.cp for _, own, _ in rows],
        "Cpk [-]": [own.fit.cpk for _, own, _ in rows],
        # Of parts whose mean and σ alone are stated nothing can be fitted.
        "distribution": [fitted.distribution.value if fitted else "normal" for _, _, fitted in rows],
        "AIC [-]": [fitted.aic if fitted else np.nan for _, _, fitted in rows],
        "Kolmogorov–Smirnov distance [-]": [fitted.distance if fitted else np.nan for _, _, fitted in rows],
        "best": ["no" if fitted and fitted is not own.fit.best else "yes" for _, own, fitted in rows],
    }
    return (("measured parts", pd.DataFrame(columns)),) if rows else ()


def work_table(header: Header) -> pd.DataFrame:
    """Return what each stage took, and how its units ended."""
    heads = {"units": "units [-]", "seconds": "seconds [s]", "units per second": "units per second [1/s]"}
    rows = [{"stage": stage, **{head: own[key] for key, head in heads.items()}} for stage, own in header.stages.items()]
    return pd.DataFrame(rows, columns=["stage", *heads.values()])
