"""What to do with a bad unit, and which gauge reading is worth its time before that is decided."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, Field

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.drawings.distributions import ndtr
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source, known_as, meant
from tolalloc.exceptions import Faults, SolveError, UnknownNameError
from tolalloc.reading.files import Record, read_toml, validated
from tolalloc.reading.units import MICROMETRE, currency_in
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.wings.bench.posterior import GaugeReading, gauges_shown

KEEP, SCRAP = "leave it as it is", "scrap it"
"""Decisions besides the change of a part."""

REDRAWN = 4
"""New parts that are drawn for each unit and each change [-]."""

_CLASS, _CLASSES = 64, (2, 64)
"""Units in one class of a reading; fewest and most classes [-]."""


def _currency(text: str) -> str:
    if text and currency_in(text) != text:
        raise ValueError("allowed are three letters such as EUR, or €, $, £ or ¥")
    return text


def _some(minutes: dict[str, float]) -> dict[str, float]:
    if not minutes:
        raise ValueError("allowed is one source or more, each with its minutes")
    return minutes


Price = Annotated[float, Field(ge=0, le=1e9)]
Minutes = Annotated[float, Field(gt=0, le=1e5)]
Micrometres = Annotated[float, Field(gt=0, le=200)]


class Repair(Record):
    """What may be done with a bad unit, at which prices; names of sources are patterns, the last that fits counts."""

    limit_arcsec: Annotated[float, Field(gt=0, le=3600)]
    """Peak-to-peak that a good unit does not exceed [arcsec]."""
    scrap: Price
    """Price of a unit that is scrapped [cost units]."""
    change: dict[str, Price] = Field(default_factory=dict)
    """Sources of parts that are changed together → price of that change, with the bench after it [cost units]."""
    minutes: Annotated[dict[str, Minutes], AfterValidator(_some)]
    """Sources that a gauge can read → minutes of one reading [min]."""
    minute: Price
    """Price of a minute at the gauge [cost units]."""
    miss: Price | None = None
    """Price of a unit that misses the limit after all; that of scrap unless given [cost units]."""
    gauge_um: Micrometres = 0.5
    """Standard deviation of a reading, an assumption unless given [µm]."""
    gauges: dict[str, Micrometres] = Field(default_factory=dict)
    """Sources whose gauge has another one → its standard deviation [µm]."""
    read: dict[str, Annotated[float, Field(ge=-1e4, le=1e4)]] = Field(default_factory=dict)
    """Sources that a gauge has read already → what it showed, as the table of sources has it [µm]."""
    currency: Annotated[str, AfterValidator(_currency)] = ""
    """What the prices are in."""

    @property
    def missed(self) -> float:
        """Price of a unit that misses the limit after all [cost units]."""
        return self.scrap if self.miss is None else self.miss

    def gauge(self, source: Source) -> float:
        """Return the standard deviation of a reading of a source [m]."""
        return (_last(self.gauges, source) or self.gauge_um) * MICROMETRE

    def readings(self, sources: Sequence[Source]) -> tuple[GaugeReading, ...]:
        """Return the readings that were taken already."""
        named = {name: own for own in sources for name in (own.name, own.own_id) if name}
        return tuple(
            GaugeReading(source=named[name], value=value * MICROMETRE, deviation=self.gauge(named[name]))
            for name, value in self.read.items()
        )

    def candidates(self, sources: Sequence[Source]) -> tuple[tuple[int, float, float], ...]:
        """Return place, minutes and standard deviation [m] of every reading that can still be taken."""
        taken, found = {own.source.name for own in self.readings(sources)}, []
        for at, source in enumerate(sources):
            minutes = _last(self.minutes, source)
            if minutes and source.name not in taken:
                found.append((at, minutes, self.gauge(source)))
        return tuple(found)


def _last(prices: Mapping[str, float], source: Source) -> float:
    """Return what stands behind the last pattern that means a source; 0 where none does."""
    return next((value for pattern, value in reversed(list(prices.items())) if meant(pattern, (source,))), 0.0)


def load_repair(path: Path, errors: ErrorModel) -> Repair:
    """Return the prices of a TOML file."""
    repair = validated(Repair, read_toml(path), path)
    known, faults = known_as(errors.active), Faults()
    for field in ("change", "minutes", "gauges", "read"):
        for name in getattr(repair, field):
            with faults.kept():
                if not (name in known if field == "read" else meant(name, errors.active)):
                    raise UnknownNameError.among(path, f"source of {field}", name, known)
    faults.require_none()
    return repair


@dataclass(frozen=True, kw_only=True)
class NextReading:
    """What one gauge reading would be worth."""

    source: str
    minutes: float  # Of its gauge [min]
    gauge: float  # Standard deviation of the reading [m]
    # Expected cost of the best decision now, and after the reading [cost units]
    before: float
    after: float
    error: float  # Standard error of their difference [cost units]
    price: float  # Of the minutes [cost units]

    @property
    def gain(self) -> float:
        """What the reading saves on average, its time not counted [cost units]."""
        return self.before - self.after

    @property
    def gain_per_minute(self) -> float:
        """The same per minute [cost units/min]."""
        return self.gain / self.minutes

    @property
    def worth(self) -> float:
        """What it saves beyond the price of its minutes [cost units]."""
        return self.gain - self.price

    @property
    def pays(self) -> bool:
        """Whether that is positive beyond the standard error of so few units."""
        return self.worth > self.error


@dataclass(frozen=True, kw_only=True)
class Advice:
    """What to do with a unit as far as it is known, and what to measure before."""

    decisions: tuple[str, ...]
    cost: Float[np.ndarray, " decision"]  # Expected cost of each [cost units]
    error: Float[np.ndarray, " decision"]  # Standard error of it [cost units]
    readings: tuple[NextReading, ...]  # The worthiest first

    @property
    def best(self) -> str:
        """The decision that costs least as far as the unit is known."""
        return self.decisions[int(self.cost.argmin())]

    @property
    def next(self) -> NextReading | None:
        """The reading to take next; None if none is worth its time."""
        return next((own for own in self.readings if own.pays), None)


def repair_costs(
    kernel: KernelResponse,
    errors: ErrorModel,
    units: Float[np.ndarray, "unit column"],
    repair: Repair,
    generator: np.random.Generator,
) -> tuple[tuple[str, ...], Float[np.ndarray, "unit decision"]]:
    """Return the decisions, and what each costs on average if the bad unit is one of these [cost units].

    A unit that is left as it is or has got new parts costs `Repair.missed` if its peak-to-peak is beyond the limit, or
    not known. New parts are drawn from the drawing, `REDRAWN` times for each unit, independently of all others.
    """
    owner, names = np.array(errors.source_of_column), tuple(repair.change)
    cases = [units]
    for pattern in names:
        new = np.isin(owner, meant(pattern, errors.active))
        for _ in range(REDRAWN):
            drawn = errors.deviations_of_normal(generator.standard_normal(units.shape), errors.zones)
            cases.append(np.where(new, drawn, units))
    evaluation = kernel(np.concatenate(cases))
    if (~evaluation.good).mean() > LARGEST_FAILED_SHARE:
        raise SolveError(f"{(~evaluation.good).sum()} of {evaluation.good.size} repaired units failed to solve.")
    missed = ~(evaluation.good & (evaluation.values[:, 0] <= repair.limit_arcsec)).reshape(len(cases), -1)
    share = missed[1:].reshape(len(names), REDRAWN, -1).mean(axis=1)
    price = np.array([repair.change[name] for name in names])[:, np.newaxis]
    rows = [np.full(len(units), repair.scrap), repair.missed * missed[0], *(price + repair.missed * share)]
    return (SCRAP, KEEP, *(f"change {name}" for name in names)), np.stack(rows, axis=1)


def advised(
    kernel: KernelResponse,
    errors: ErrorModel,
    units: Float[np.ndarray, "unit column"],
    repair: Repair,
    generator: np.random.Generator,
) -> Advice:
    """Return what to do with a unit that is equally likely to be each of these, and what to measure before."""
    decisions, costs = repair_costs(kernel, errors, units, repair, generator)
    shown, readings = gauges_shown(errors, errors.active, units), []
    for at, minutes, gauge in repair.candidates(errors.active):
        readings.append(worth_of(errors.active[at].name, costs, shown[:, at], gauge, minutes, repair.minute))
    return Advice(
        decisions=decisions,
        cost=costs.mean(axis=0),
        error=costs.std(axis=0) / np.sqrt(len(costs)),
        readings=tuple(sorted(readings, key=lambda own: -own.worth)),
    )


def worth_of(
    source: str,
    costs: Float[np.ndarray, "unit decision"],
    shown: Float[np.ndarray, " unit"],
    gauge: float,
    minutes: float,
    minute: float,
) -> NextReading:
    """Return what a reading is worth before a decision.

    Costs are those of each decision for each of the units that are equally likely, shown is what an exact gauge would
    read of them, gauge the standard deviation of the real one, in the unit of shown.

    Expected value of sample information, E[min E[L_d | reading]] against min E[L_d]. A reading is told as one of
    classes of equal probability, into which the gauge's error spreads each unit by its normal probability p_jk; no
    class has so few units that chance decides in it. What to do in a class is learnt from one half of the units and
    paid by the other half, and the halves exchanged, so that chance is not taken for knowledge; if that costs more
    than to decide without the reading, the reading is not heeded and the gain is 0. So 0 ≤ gain ≤ E[L] − E[min L_d].

    References
    ----------
    Raiffa & Schlaifer, Applied statistical decision theory, 1961, section 4.5.

    Examples
    --------
    A part that is bad in half of all units is changed for 10, or the unit costs 100. A gauge that tells saves 5:

    >>> bad = np.tile([0.0, 1.0], 512)
    >>> found = worth_of("a", np.stack([100.0 * bad, np.full(1024, 10.0)], axis=1), bad, 0.01, 2.0, 1.0)
    >>> round(found.before, 3), round(found.gain, 3), round(found.worth, 3), found.pays
    (10.0, 5.0, 3.0, True)
    """
    first = int(costs.mean(axis=0).argmin())
    paid = np.full(len(costs), costs.mean(axis=0)[first])
    chance = _class_chances(shown, gauge)
    extra = costs - costs[:, [first]]
    gained = np.zeros(len(costs))
    half = np.arange(len(costs)) < len(costs) // 2  # particles of one origin stand side by side
    for learnt in (half, ~half):
        choice = (chance[learnt].T @ extra[learnt]).argmin(axis=1)
        gained[~learnt] = -(chance[~learnt] * extra[~learnt][:, choice]).sum(axis=1)
    gain = max(float(gained.mean()), 0.0)
    before = float(paid.mean())
    return NextReading(
        source=source,
        minutes=minutes,
        gauge=gauge,
        before=before,
        after=before - gain,
        error=float(gained.std() / np.sqrt(len(gained))),
        price=minutes * minute,
    )


def _class_chances(shown: Float[np.ndarray, " unit"], gauge: float) -> Float[np.ndarray, "unit class"]:
    """Return the probability with which the reading of each unit falls into each class [-]."""
    least, most = _CLASSES
    count = int(np.clip(len(shown) // _CLASS, least, most))
    spread = float(shown.std())
    wider = np.hypot(spread, gauge) / spread if spread > 0.0 else 1.0  # readings reach further out than sources
    cuts = np.unique(shown.mean() + wider * (np.quantile(shown, np.arange(1, count) / count) - shown.mean()))
    if gauge == 0.0:
        below = (shown[:, np.newaxis] <= cuts).astype(float)
    else:
        below = ndtr((cuts - shown[:, np.newaxis]) / gauge)
    ends = np.zeros((len(shown), 1)), np.ones((len(shown), 1))
    return np.diff(np.concatenate([ends[0], below, ends[1]], axis=1), axis=1)
