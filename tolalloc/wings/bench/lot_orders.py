"""Orders of the transmission-error curves of a lot, against those that random units of its drawing make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, pi, sqrt
from pathlib import Path

import numpy as np
from jaxtyping import Complex, Float

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import Faults, InputError, SolveError
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.equivalent.outputs import fitted_waves
from tolalloc.reducers.model import ReducerModel
from tolalloc.running.progress import RunRecord
from tolalloc.wings.bench.posterior import Noise
from tolalloc.wings.bench.processes import two_sided
from tolalloc.wings.bench.readings import (
    ANGLE,
    TRANSMISSION_ERROR,
    TURN,
    Cleaned,
    clean_curve,
    load_readings,
    require_torque,
)

CURVES = (5, 200)
"""Fewest and most curves of a lot [-]."""
SHARE = 0.05
"""Part of an order's variance from which on a source is named [-]."""
_UNITS, _REDRAWN = 4000, 128
"""Random units of the drawing, and those of them of which every source is drawn again [-]."""
_DRAWN, _CHUNK = 2**25, 2**20
"""Waves of simulated lots of one order from which on there are fewer lots, and those held at once [-]."""
_ENDS = (0.05, 0.95)
"""Shares of lots below the ends of a predicted range [-]."""
_PER_WAVE = 3
"""Fewest readings along a wave of the highest order [-]."""


@dataclass(frozen=True, kw_only=True)
class LotOrder:
    """What the curves of a lot show of one order of the output turn."""

    order: float  # Waves per output turn [-]
    amplitude: float  # Root mean square over the units [arcsec]
    predicted: tuple[float, float]  # Where it lies in 90 % of lots of the drawing [arcsec]
    probability: float  # Of a mean square as far out if the units are the drawing's [-]
    moved: bool = False  # At the false-alarm rate of the lot
    # Correlated sources together, and the part of the order's variance in which they take part, from `SHARE` on, the
    # largest first; only of a moved order [-]
    sources: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, kw_only=True)
class LotCurves:
    """Curves of units of a lot, and the model that predicts them."""

    model: ReducerModel  # At the sources of the drawing and the torque of the curves
    errors: ErrorModel  # What the drawing says of the parts
    orders: tuple[float, ...]  # Those of the model's spectra that all readings hold [-]
    waves: Complex[np.ndarray, "unit order"]  # Cosine less i times sine amplitudes [arcsec]
    noise: Float[np.ndarray, " unit"]  # Standard deviation of cosine and sine by the readings [arcsec]
    discrepancy: Noise  # What the model leaves out
    repairs: tuple[str, ...] = ()  # What was mended, prefixed by the file

    def observed(self, record: RunRecord) -> LotCurves:
        """Return the same with a model whose units a record counts."""
        return replace(self, model=replace(self.model, kernel=replace(self.model.kernel, observe=record.observe)))

    def made(self, x: Float[np.ndarray, "sample column"]) -> Complex[np.ndarray, "sample order"]:
        """Return the waves of units of the model, NaN where one failed [arcsec]."""
        found = self.model.reading(tuple(name for own in self.orders for name in self.model.spectra[own]))(x)
        cosine, sine = found.values.reshape(len(x), -1, 2).transpose(2, 0, 1)
        return np.where((found.status == 0)[:, np.newaxis], cosine - 1j * sine, np.nan)


@dataclass(frozen=True, kw_only=True)
class PredictedOrder:
    """What lots of the drawing do in one order: their mean squares, ascending [arcsec²]."""

    order: float  # [-]
    exact: Float[np.ndarray, " lot"]  # As if the bench did not err and the model left nothing out
    read: Float[np.ndarray, " lot"]  # With noise and discrepancy as they are stated

    def judged(self, waves: Complex[np.ndarray, " unit"]) -> LotOrder:
        """Return an order of a lot beside its prediction.

        Noise and discrepancy are known as bounds, so that a lot is held to be too small against lots without them, and
        too large against lots with them: twice the smaller tail, the lot counted as one of the simulated ones.
        """
        square = float((np.abs(waves) ** 2).mean())
        low, high = float(np.quantile(self.exact, _ENDS[0])), float(np.quantile(self.read, _ENDS[1]))
        return LotOrder(
            order=self.order,
            amplitude=sqrt(square),
            predicted=(sqrt(max(low, 0.0)), sqrt(high)),
            probability=two_sided(square, self.exact, self.read),
        )


def load_lot_curves(folder: Path, model: ReducerModel, errors: ErrorModel, noise: Noise) -> LotCurves:
    """Return the waves of the curves in a folder, a CSV file per unit; all faults of its files together."""
    files = sorted(folder.glob("*.csv"))
    least, most = CURVES
    if not least <= len(files) <= most:
        raise InputError.at(folder, "the number of curves", len(files), f"a folder of {least} to {most} CSV files")
    faults, curves, repairs, deviations = Faults(), list[Cleaned](), list[str](), list[float]()
    for file in files:
        with faults.kept():
            require_torque(file, model.kernel.torque)
            curve = clean_curve(load_readings(file, ANGLE, TRANSMISSION_ERROR))
            _require_close(file, curve, max(model.spectra))
            curves.append(curve)
            deviations.append(noise.reading * curve.noise_factor * sqrt(2.0 / curve.along.size) / ARCSECOND)
            repairs += [f"{file.name}: {own}" for own in curve.repairs]
    faults.require_none()
    orders = [own for own in model.spectra if all(model.reducer.resolves(own, one.along.size) for one in curves)]
    waves = [fitted_waves(own.along, own.values[np.newaxis], np.array(orders))[0] for own in curves]
    return LotCurves(
        model=model,
        errors=errors,
        orders=tuple(orders),
        waves=np.array(waves) / ARCSECOND,
        noise=np.array(deviations),
        discrepancy=noise,
        repairs=tuple(repairs),
    )


def _require_close(file: Path, curve: Cleaned, highest: float) -> None:
    """Raise unless the readings tell the highest order all round the turn."""
    readings, angle, fewest = curve.along.size, np.sort(np.mod(curve.along, TURN)), _PER_WAVE * highest
    if readings < fewest:
        allowed = f"{fewest} or more, {_PER_WAVE} for each wave of order {highest}"
        raise InputError.at(file, "the number of readings", readings, allowed)
    widest = float(np.diff(angle, append=angle[0] + TURN).max()) / DEGREE
    if widest > 360.0 / highest:
        allowed = f"up to {360.0 / highest:.3g} deg, a wave of order {highest}, all round the turn"
        raise InputError.at(file, "the widest gap between its angles", f"{widest:.3g} deg", allowed)


def predicted_orders(curves: LotCurves, lots: int, seed: int) -> tuple[PredictedOrder, ...]:
    """Return what so many simulated lots of the drawing do in every order.

    Units are drawn on the model, lots from these units. What the model leaves out is one function for all units of a
    lot, an assumption. What so many units leave open of their own mean square, its standard error, is added to every
    lot.
    """
    seeds = SeedTree(seed).child("lot", "curves")
    made = curves.made(curves.errors.random_units(_UNITS, seeds.child("units")))
    made = made[np.isfinite(made).all(axis=1)]
    if len(made) < (1.0 - LARGEST_FAILED_SHARE) * _UNITS:
        raise SolveError(f"{_UNITS - len(made)} of {_UNITS} units of the drawing failed to solve.")
    generator, units = seeds.child("lots").generator(), len(curves.noise)
    lots = min(lots, max(_DRAWN // units, 2**14))
    found = list[PredictedOrder]()
    for order, own in zip(curves.orders, made.T, strict=True):
        left_out = left_out_of(order, curves.discrepancy)
        exact, read, step = np.empty(lots), np.empty(lots), max(1, _CHUNK // units)
        for start in range(0, lots, step):
            part = slice(start, min(start + step, lots))
            lot = own[generator.integers(own.size, size=(part.stop - start, units))]
            exact[part] = (np.abs(lot) ** 2).mean(axis=1)
            lot += curves.noise * _normal(generator, *lot.shape) + left_out * _normal(generator, len(lot), 1)
            read[part] = (np.abs(lot) ** 2).mean(axis=1)
        open_left = float((np.abs(own) ** 2).std()) / sqrt(own.size) * generator.standard_normal(lots)
        found.append(PredictedOrder(order=order, exact=np.sort(exact + open_left), read=np.sort(read + open_left)))
    return tuple(found)


def left_out_of(order: float, noise: Noise) -> float:
    """Return the standard deviation of cosine and sine of what the model leaves out of an order [arcsec].

    √(√(2/π)·a)·s·exp(−(k·a)²/4) at the standard deviation s and the correlation angle a: the variance of a wave is
    1/π·∫C(Δ)·cos(k·Δ)dΔ over the covariance C of `Noise.left_out` (own derivation).

    >>> round(left_out_of(2, Noise()), 4)
    0.0722
    """
    angle = noise.correlation_angle
    return noise.discrepancy / ARCSECOND * sqrt(sqrt(2.0 / pi) * angle) * exp(-0.25 * (order * angle) ** 2)


def _normal(generator: np.random.Generator, *shape: int) -> Complex[np.ndarray, "..."]:
    """Return complex numbers whose both parts are standard normal [-]."""
    real, imaginary = generator.standard_normal((2, *shape))
    return np.asarray(real + 1j * imaginary)


def judged_orders(curves: LotCurves, predicted: Sequence[PredictedOrder]) -> tuple[LotOrder, ...]:
    """Return the orders of the curves beside their predictions; whether one moved is not said yet."""
    return tuple(own.judged(waves) for own, waves in zip(predicted, curves.waves.T, strict=True))


def with_sources(
    curves: LotCurves, orders: Sequence[LotOrder], moved: Sequence[bool], seed: int
) -> tuple[LotOrder, ...]:
    """Return the orders and which of them moved, of each that did the sources that make it in units of the drawing.

    The total effect of a source, the mean of ½|w − w'|² over the variance of the wave, w' with that source drawn again
    (Jansen, Computer Physics Communications 117, 1999, 35–43). Sources act on each other, so that shares sum to more
    than 1; one that does nothing alone is found too.
    """
    if not any(moved):
        return tuple(orders)
    seeds = SeedTree(seed).child("lot", "sources")
    x, again = (curves.errors.random_units(_REDRAWN, seeds.child(name)) for name in ("first", "again"))
    owner, made = np.array(curves.errors.block_of_column), curves.made(x)
    variance, shares = np.nanvar(made, axis=0), dict[str, np.ndarray]()
    for name in dict.fromkeys(owner.tolist()):
        apart = made - curves.made(np.where(owner == name, again, x))
        shares[name] = np.nanmean(np.abs(apart) ** 2, axis=0) / (2.0 * variance)
    found = list[LotOrder]()
    for at, (own, is_moved) in enumerate(zip(orders, moved, strict=True)):
        makers = [(name, float(share[at])) for name, share in shares.items() if is_moved and share[at] >= SHARE]
        makers.sort(key=lambda pair: -pair[1])
        found.append(replace(own, moved=bool(is_moved), sources=tuple(makers)))
    return tuple(found)
