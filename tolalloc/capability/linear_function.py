"""A function that is linear in the deviations, and the exact law of its values: shares without a sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from tolalloc.capability.indices import Limits
from tolalloc.drawings.distributions import NORMAL, RAYLEIGH, Marginal
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.models.model import Samples

AtSamples = Float[np.ndarray, " sample"]
"""A number of every sample."""
AtSources = Float[np.ndarray, " source"]
"""A number of every active source."""
AtPoints = Float[np.ndarray, " point"]
"""A number at every point of a grid or curve."""
_LINEAR = 1e-9
"""Distance of a value from the plane, over the range of the values, up to which it is rounding [-]."""
_SPARE = 64
"""Samples beside those that fix the plane that it is tried on before all are [-]."""
_POINTS = 2**15
"""Points on which densities are folded; a share of 0.27 % is then right to 1e-7 (uniform sums, tested) [-]."""
_TAIL = 1e-13
"""Probability beyond which an endless distribution is cut [-]."""
_FAR = 0.5
"""Standard deviation from a plane, over that of the output, from which the plane says too little of it [-]."""
_DEGREE, _POINTS_OF_CURVE = 5, 2049
"""Degree of the polynomial behind which a plane may lie, and points at which it is tabulated [-]."""
_ENDS = 100.0
"""How far the curve goes on straight beyond the values that made it, over their range [-]."""
_REACH = 12.0
"""Standard deviations of the normal part that the points cover to either side [-]."""


@dataclass(frozen=True, kw_only=True)
class LinearFunction:
    """y = offset + Σ slope·deviation."""

    offset: float  # Value without deviations [unit of the output]
    slopes: Float[np.ndarray, " column"]  # Derivatives by the columns [unit of the output per m, angles per rad]
    rounding: float  # Distance from the plane up to which a value lies on it [unit of the output]

    @classmethod
    def through(cls, x: Samples, values: AtSamples) -> LinearFunction | None:
        """Return the plane that all samples lie on up to rounding, none if one does not or has no answer."""
        return cls.through_each(x, {"": values}).get("")

    @classmethod
    def through_each(cls, x: Samples, outputs: Mapping[str, AtSamples]) -> dict[str, LinearFunction]:
        """Return the planes of those outputs whose samples all lie on one, by their names."""
        few, found = x.shape[1] + _SPARE, dict[str, LinearFunction]()
        known = {name: values for name, values in outputs.items() if values.size > few and np.isfinite(values).all()}
        if not known:
            return found
        centre, size = x[:few].mean(axis=0), np.maximum(x[:few].std(axis=0), np.finfo(float).tiny)
        middles = [float(values[:few].mean()) for values in known.values()]
        off = np.stack([values[:few] - middle for values, middle in zip(known.values(), middles, strict=True)], axis=1)
        solved = np.linalg.lstsq((x[:few] - centre) / size, off, rcond=None)[0].T / size
        for (name, values), slopes, middle in zip(known.items(), solved, middles, strict=True):
            plane = cls(offset=float(middle - centre @ slopes), slopes=slopes, rounding=_LINEAR * float(np.ptp(values)))
            if not (plane.leaves(x[:few], values[:few]).any() or plane.leaves(x, values).any()):
                found[name] = plane
        return found

    @classmethod
    def near(cls, x: Samples, values: AtSamples) -> LinearFunction:
        """Return the plane nearest to samples by least squares."""
        centre, size = x.mean(axis=0), np.maximum(x.std(axis=0), np.finfo(float).tiny)
        standard, middle = (x - centre) / size, float(values.mean())
        # Columns are independent or nearly so: the small system of their products is well conditioned.
        slopes = np.linalg.lstsq(standard.T @ standard, standard.T @ (values - middle), rcond=None)[0] / size
        return cls(offset=float(middle - centre @ slopes), slopes=slopes, rounding=0.0)

    def __call__(self, x: Samples) -> AtSamples:
        """Return the values on the plane [unit of the output]."""
        return np.asarray(self.offset + x @ self.slopes)

    def leaves(self, x: Samples, values: AtSamples) -> Bool[np.ndarray, " sample"]:
        """Return which values do not lie on the plane; one that is not a number does not."""
        return np.asarray(np.logical_not(np.abs(values - self(x)) <= self.rounding))


@dataclass(frozen=True, kw_only=True)
class _AddedColumn:
    """What one column that is not normal adds: width·marginal."""

    source: int  # Position of its source
    marginal: Marginal
    width: float  # [unit of the output per half zone]

    def masses(self, step: float) -> AtPoints:
        """Return the probabilities of the cells around multiples of a step, those below zero at the end [-]."""
        places = (np.arange(_POINTS) - _POINTS // 2) * step
        edges = np.append(places - step / 2, places[-1] + step / 2)
        below = self.marginal.probability(edges / self.width)
        below = below if self.width > 0 else 1.0 - below
        return np.asarray(np.fft.ifftshift(np.diff(below)))

    @property
    def reach(self) -> float:
        """Largest distance from the middle [unit of the output]."""
        ends = self.marginal.quantile(np.array([_TAIL, 1.0 - _TAIL]))
        return float(np.abs(ends * self.width).max())


@dataclass(frozen=True, kw_only=True)
class LinearLaw:
    """Law of a linear function of the sources at some zones, theory page equation (77).

    Notes
    -----
    The columns that are normal add up to one normal number, correlated ones too. All others are independent; their
    densities are folded with it on a grid by the Fourier transform. A source that this does not know, such as the
    random radius of a position that is not normal, has no such law.
    """

    function: LinearFunction
    errors: ErrorModel
    zones: AtSources  # Zones of the active sources [m]

    @classmethod
    def of(cls, function: LinearFunction, errors: ErrorModel, zones: AtSources) -> LinearLaw | None:
        """Return the law, none where a source has a distribution that cannot be folded, or parts are chosen."""
        if errors.compensators:
            return None
        correlated = {name for block in errors.blocks if len(block) > 1 for name in block}
        for source in errors.active:
            folded = _is_normal(source) or (source.feature is Feature.SIZE and source.name not in correlated)
            if not folded:
                return None
        law = cls(function=function, errors=errors, zones=zones)
        return law if not errors.joint and law.half_width > 0 else None

    @property
    def is_convex(self) -> bool:
        """Whether zones that keep an upper or a lower limit make a convex set, whatever the yield above one half.

        So it is where every density is symmetric and its logarithm concave (Lagoa, Li & Sznaier 2005).
        """
        return all(
            source.distribution.form.is_symmetric(source.shapes) and source.feature in _KNOWN
            for source in self.errors.active
        )

    @property
    def is_normal(self) -> bool:
        """Whether the value is a normal number."""
        return not self._parts

    @cached_property
    def centre(self) -> float:
        """Value of the middles of all zones, and of the means of what is normal [unit of the output]."""
        return float(self.function.offset + (self.errors.middles + self._zone_means) @ self.function.slopes)

    def beyond(self, limits: Limits, by: float) -> float:
        """Return the share of units that lie further beyond a limit than so far [unit of the output]."""
        return sum(self.share_above(sign, limit + sign * by) for sign, limit in limits.turned)

    def excess(self, limits: Limits, share: float) -> float:
        """Return how far beyond a limit just this share of units lies, negative inside [unit of the output]."""
        from scipy.optimize import brentq

        if not 0.0 < share < 1.0:
            return float(np.inf if share <= 0 else -np.inf)
        reach = self.half_width
        ends = [sign * (self.centre - limit) for sign, limit in limits.turned]
        found = brentq(
            lambda by: self.beyond(limits, by) - share, min(ends) - reach, max(ends) + reach, xtol=1e-12 * reach
        )
        return float(found)

    def upper_part(self, limits: Limits, by: float) -> float:
        """Return by which part of its own change the upper of two limits moves `excess`, the lower one by the rest [-].

        ∂e/∂limit = f(limit + e)/Σ f with the density f there (own derivation).
        """
        upper, lower = (self._at(limit + sign * by)[0] for sign, limit in limits.turned)
        return upper / max(upper + lower, np.finfo(float).tiny)

    def excess_by_zone(self, limits: Limits, by: float) -> AtSources:
        """Return the derivative of `excess` by the zones at a share that it has [unit of the output per m].

        Notes
        -----
        ∂q/∂z = E[∂y/∂z | y = q], theory page equation (77), each limited side with the density that it has there.
        """
        found, weights = np.zeros(self.zones.size), 0.0
        for sign, limit in limits.turned:
            density, added = self._at(limit + sign * by)
            found += sign * added
            weights += density
        return np.asarray(found / max(weights, np.finfo(float).tiny) / self.zones)

    def share_above(self, sign: int, value: float) -> float:
        """Return the share of units above a value, or below one [-]."""
        from scipy.special import ndtr

        if not self._parts:
            return float(ndtr(-sign * (value - self.centre) / self._normal_deviation))
        step, _ = self._grid
        at = (value - self.centre) / step + _POINTS // 2 + 0.5
        below = float(np.interp(at, np.arange(_POINTS + 1), self._cumulative))
        return 1.0 - below if sign > 0 else below

    def _at(self, value: float) -> tuple[float, AtSources]:
        """Return the density at a value and the density times what each source adds on average to units there."""
        distance, sources = value - self.centre, self.zones.size
        shift = np.bincount(self._source_of_column, self._zone_means * self.function.slopes, sources)
        variance = max(self._normal_deviation**2, np.finfo(float).tiny)
        shares = np.bincount(self._source_of_column, self._covariances, sources) / variance
        if not self._parts:
            deviation = self._normal_deviation
            density = float(np.exp(-0.5 * (distance / deviation) ** 2) / (np.sqrt(2 * np.pi) * deviation))
            return density, density * (shift + shares * distance)
        step, frequency = self._grid
        at = distance / step + _POINTS // 2
        whole = self._spectra.prod(axis=0) * self._normal_spectrum
        density = self._read(whole, at) / step
        added = density * shift
        if self._normal_deviation > 0:
            turned = 1j * frequency * self._normal_deviation**2 * whole  # of n·φ(n), up to its sign
            added += shares * (self._read(-turned, at) / step)
        for number, part in enumerate(self._parts):
            places = np.fft.ifftshift((np.arange(_POINTS) - _POINTS // 2) * step)
            own = np.fft.fft(part.masses(step) * places)
            others = np.delete(self._spectra, number, axis=0).prod(axis=0) * self._normal_spectrum
            added[part.source] += self._read(own * others, at) / step
        return density, added

    def _read(self, spectrum: Complex[np.ndarray, " point"], at: float) -> float:
        """Return the value of a transformed density at a place of the grid."""
        values = np.fft.fftshift(np.fft.ifft(spectrum).real)
        return float(np.interp(at, np.arange(_POINTS), values))

    @cached_property
    def _source_of_column(self) -> Int[np.ndarray, " column"]:
        counts = np.array([len(source.columns) for source in self.errors.active], int)
        return np.repeat(np.arange(counts.size), counts)

    @cached_property
    def _zone_means(self) -> Float[np.ndarray, " column"]:
        """Mean of what the zone gives each normal column beside its middle [m]."""
        found = [
            source.zone_mapping.moments[0] / source.lever * zone
            if source.feature is Feature.SIZE and _is_normal(source)
            else 0.0
            for source, zone in zip(self.errors.active, self.zones, strict=True)
        ]
        return np.asarray(np.array(found)[self._source_of_column])

    @cached_property
    def _normal_loads(self) -> Float[np.ndarray, " column"]:
        """Slope times standard deviation of every normal column, zero for others [unit of the output]."""
        found = []
        for source, zone in zip(self.errors.active, self.zones, strict=True):
            mapping, count = source.zone_mapping, len(source.columns)
            if not _is_normal(source):
                found += [0.0] * count
            elif source.feature is Feature.SIZE:
                found += [mapping.moments[1] / source.lever * zone] * count
            else:
                waves = np.tile(np.repeat(mapping.amplitudes, 2), source.each)
                found += (mapping.wave_deviation * waves / source.lever * zone).tolist()
        return np.asarray(np.array(found) * self.function.slopes)

    @cached_property
    def _covariances(self) -> Float[np.ndarray, " column"]:
        """Covariance of every normal column's part with the whole normal part [unit of the output²]."""
        loads = self._normal_loads
        return np.asarray(loads * (self.errors.normal_correlation @ loads if self.errors.is_correlated else loads))

    @cached_property
    def variances(self) -> Float[np.ndarray, " column"]:
        """What every column adds to the variance, half of what two share to each of them [unit of the output²]."""
        alone = [
            0.0 if _is_normal(source) else source.zone_mapping.moments[1] / source.lever * zone
            for source, zone in zip(self.errors.active, self.zones, strict=True)
        ]
        own = np.array(alone)[self._source_of_column] * self.function.slopes
        return np.asarray(self._covariances + own**2)

    @cached_property
    def _normal_deviation(self) -> float:
        return float(np.sqrt(max(self._covariances.sum(), 0.0)))

    @cached_property
    def _parts(self) -> tuple[_AddedColumn, ...]:
        found = []
        for at, slope in zip(self._source_of_column, self.function.slopes, strict=True):
            source = self.errors.active[at]
            width = float(slope * self.zones[at] / 2 / source.lever)
            if width != 0.0 and not _is_normal(source):
                found.append(_AddedColumn(source=int(at), marginal=source.zone_mapping.marginal, width=width))
        return tuple(found)

    @cached_property
    def half_width(self) -> float:
        """Distance from the mean beyond which nothing lies [unit of the output]."""
        return sum(part.reach for part in self._parts) + _REACH * self._normal_deviation

    @cached_property
    def _grid(self) -> tuple[float, AtPoints]:
        """Step between points [unit of the output], and their angular frequencies."""
        step = 2.05 * self.half_width / _POINTS
        return step, 2 * np.pi * np.fft.fftfreq(_POINTS, step)

    @cached_property
    def _normal_spectrum(self) -> AtPoints:
        return np.asarray(np.exp(-0.5 * (self._grid[1] * self._normal_deviation) ** 2))

    @cached_property
    def _spectra(self) -> Complex[np.ndarray, "part point"]:
        return np.array([np.fft.fft(part.masses(self._grid[0])) for part in self._parts])

    @cached_property
    def _cumulative(self) -> Float[np.ndarray, " edge"]:
        masses = np.fft.fftshift(np.fft.ifft(self._spectra.prod(axis=0) * self._normal_spectrum).real)
        return np.append(0.0, np.cumsum(np.maximum(masses, 0.0)))


@dataclass(frozen=True, kw_only=True)
class NearPlane:
    """A plane near an output, or near a monotone curve of it, of which the law is known.

    Notes
    -----
    What bends in one direction alone, such as an angle over a chain of sizes, is a plane behind a curve: normal scores
    of its values are regressed on the deviations, and the curve is a polynomial of degree 5 through what the plane says
    over the values (one step of alternating conditional expectations, Breiman & Friedman 1985). Nothing is believed of
    it (`tolalloc.allocation.space.output_sample.ControlPlane`).
    """

    law: LinearLaw  # Of the plane
    # Points of the curve: values of the output [unit of the output], and of the plane; none where there is no curve
    curve: tuple[AtPoints, AtPoints] | None = None

    @classmethod
    def of(cls, x: Samples, values: AtSamples, errors: ErrorModel, zones: AtSources) -> NearPlane | None:
        """Return what lies near an output, none where its law is not known or it says too little of the output.

        Deviations of samples [m, angles rad], and the output, not a number where there is none.
        """
        known = np.isfinite(values)
        x, values = x[known], values[known]
        if values.size <= x.shape[1] + _SPARE or not np.ptp(values) > 0:
            return None
        found = cls._bent(x, values, errors, zones)
        flat = LinearFunction.near(x, values)
        law = LinearLaw.of(flat, errors, zones)
        if law and (off := float(np.std(values - flat(x)) / np.std(values))) < (found[1] if found else _FAR):
            found = (cls(law=law), off)
        return found[0] if found else None

    @classmethod
    def _bent(
        cls, x: Samples, values: AtSamples, errors: ErrorModel, zones: AtSources
    ) -> tuple[NearPlane, float] | None:
        """Return a plane behind a curve, and by how much the curve of the output is off it over what it varies [-]."""
        from scipy.special import ndtri

        order = np.argsort(values, kind="stable")
        if np.count_nonzero(np.diff(values[order])) < _DEGREE:  # steps, through which no one curve goes
            return None
        ranks = np.empty(values.size)
        ranks[order] = (np.arange(values.size) + 0.5) / values.size
        plane = LinearFunction.near(x, ndtri(ranks))
        law, says = LinearLaw.of(plane, errors, zones), plane(x)
        curve = np.polynomial.Polynomial.fit(values, says, _DEGREE)
        points = np.linspace(values.min(), values.max(), _POINTS_OF_CURVE)
        of_plane = curve(points)
        off = float(np.std(curve(values) - says) / np.std(says)) if np.std(says) > 0 else np.inf
        if law is None or off >= _FAR or not (np.diff(of_plane) > 0).all():
            return None
        reach, slopes = _ENDS * np.ptp(points), np.diff(of_plane)[[0, -1]] / np.diff(points)[[0, -1]]
        ends = np.concatenate([[points[0] - reach], points, [points[-1] + reach]])
        of_ends = np.concatenate([[of_plane[0] - slopes[0] * reach], of_plane, [of_plane[-1] + slopes[1] * reach]])
        return cls(law=law, curve=(ends, of_ends)), off

    def __call__(self, x: Samples) -> AtSamples:
        """Return what it says of the output [unit of the output]."""
        says = self.law.function(x)
        return says if self.curve is None else np.asarray(np.interp(says, self.curve[1], self.curve[0]))

    def share_above(self, sign: int, value: float) -> float:
        """Return the share of units that it has above a value, or below one [-]."""
        of_plane = value if self.curve is None else float(np.interp(value, *self.curve))
        return self.law.share_above(sign, of_plane)

    def at(self, zones: AtSources) -> NearPlane:
        """Return it with the law of other zones [m]."""
        return replace(self, law=replace(self.law, zones=zones))


_KNOWN = (Feature.SIZE, Feature.POSITION, Feature.PITCH, Feature.RUNOUT)


def _is_normal(source: Source) -> bool:
    """Return whether all columns of a source are normal numbers."""
    mapping = source.zone_mapping
    if source.feature is Feature.SIZE:
        return mapping.base == NORMAL and not mapping.sorted
    return mapping.marginal == RAYLEIGH
