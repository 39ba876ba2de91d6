"""Error sources: what stands on the drawing, and the columns of the model that it moves."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase, translate
from functools import cache, cached_property
from itertools import groupby
from math import degrees

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import NORMAL, RAYLEIGH, Batch, Distribution, Marginal, Mixture
from tolalloc.drawings.measured_parts import MeasuredParts
from tolalloc.drawings.provenance import provenance_of
from tolalloc.drawings.zones import Feature, Spectrum, Systematic, ZoneMapping
from tolalloc.reading.units import INCH, MICROMETRE, MILLIMETRE

ANGULAR = ("tilt", "phase", "rotation")
"""Last part of the name of a source whose columns are angles."""


INCHES, PERCENT = "in", "%"
"""Units of a row beside the metric ones; a per cent is one of the nominal size."""
LENGTHS = {"µm": MICROMETRE, "mm": MILLIMETRE, INCHES: INCH}
"""Unit of a length → its length [m]."""
STEPS = ((1.0, 0.01), (10.0, 0.1), (100.0, 0.5), (np.inf, 1.0))
"""Step of a number on a reducer's drawing up to a size, where its table states none: two or three figures [µm]. An
assumption: a tenth of a micrometre is what a measuring room tells apart on parts of a reducer; finer numbers need finer
steps."""
FIGURES = tuple(
    (end * 10.0**power, step * 10.0**power) for power in range(-9, 10) for end, step in ((2, 0.005), (10, 0.01))
)
"""Step of a number on the drawing of anything else up to a size, whatever its unit: three figures, a half of the last
one up to 200, so that rounding takes less than 0.5 % of a zone [µm]. An assumption: a table states its own steps."""
RESOLVED = 10.0
"""Zone over the uncertainty of its gauge from which on the gauge is said to resolve it, the rule of many shops [-]."""
_WHOLE = 1e-6
"""Part of a step that a number may lack and still count as whole [-]."""
_ROUNDING = 1e-9
"""Mean of a deviation over its zone, up to which it is rounding [-]."""
_WRITTEN = 1e-6
"""Distance from the middle, over the zone, up to which it is what written digits leave [-]."""
_POINTS_PER_WAVE = 32
"""Points of the shortest wave of a spectrum; the range between them is at most 0.5 % too small."""
_TIMES = re.compile(r"(?:(\d+)[x×] +)?(.*?)(?: +\(?(\d+)[x×]\)?)?", re.DOTALL)


def is_angular(source: str) -> bool:
    """Return whether the columns of a source are angles, by the last part of its name."""
    return source.rpartition(".")[2] in ANGULAR


def rounded_down(number: float, step: float = 0.0, usual: Sequence[tuple[float, float]] = STEPS) -> float:
    """Return a number of a drawing rounded down to its step, or to the usual one of its size if none is given [m].

    Without either it stays as it is.

    Examples
    --------
    Of 4.75 µm the drawing states 4.7 µm, of 23.3 µm 23 µm, and 4.5 µm in steps of half a micrometre; of 106.86 µm
    that of no reducer 106.5 µm:

    >>> [round(rounded_down(*own) * 1e6, 6) for own in ((4.75e-6,), (23.3e-6,), (4.75e-6, 0.5e-6))]
    [4.7, 23.0, 4.5]
    >>> round(rounded_down(106.86e-6, usual=FIGURES) * 1e6, 6)
    106.5
    """
    size = number / MICROMETRE
    own = step / MICROMETRE or next((own for end, own in usual if size < end * (1 - _ROUNDING)), 0.0)
    if not own:
        return number
    return float(np.floor(size / own + _WHOLE) * own * MICROMETRE)


def neglected_columns(patterns: Sequence[str], columns: Sequence[str]) -> frozenset[str]:
    """Return the columns that are taken as zero: those of a source that a pattern such as ``*.tilt`` names.

    A pattern may name nothing; a misspelt one leaves its column without a value, and that is refused.
    """
    return frozenset(
        name
        for name in columns
        for pattern in patterns
        if fnmatchcase(name, pattern) or fnmatchcase(name, f"{pattern}.*")
    )


@cache
def _of_names(pattern: str) -> re.Pattern[str]:
    """Return what matches a pattern of sources: a star beside letters ends at a dot, one alone stands for any parts."""
    parts = (".*" if part == "*" else translate(part)[4:-3].replace(".", "[^.]") for part in pattern.split("."))
    return re.compile(r"\.".join(parts), re.DOTALL)


def meant(pattern: str, sources: Iterable[Source]) -> list[str]:
    """Return the names of the sources that a name, a user's own id, a pattern of either, a dimension or a row means.

    >>> from tolalloc.drawings.drawing import load_drawing
    >>> meant("disc*.pitch", load_drawing("rv20e_drawing").sources)
    ['disc1.pitch', 'disc2.pitch']
    """
    return [
        own.name
        for own in sources
        if _of_names(pattern).fullmatch(own.name)
        or (own.own_id and fnmatchcase(own.own_id, pattern))
        or pattern in filter(None, (own.dimension, own.row))
    ]


def known_as(sources: Iterable[Source]) -> list[str]:
    """Return what a file may call the sources: their names, then the user's own ids that mean one alone."""
    known = tuple(sources)
    ids = Counter(own.own_id for own in known if own.own_id)
    return [*(own.name for own in known), *(own_id for own_id, places in ids.items() if places == 1)]


def like_places(text: str) -> tuple[int, str]:
    """Return for how many like places a name stands, 0 where it does not say, and the name alone."""
    before, name, after = _TIMES.fullmatch(text).groups()  # type: ignore[union-attr]  # it matches any text
    return int(before or after or 0), name


def by_row(sources: Iterable[Source]) -> list[tuple[Source, tuple[Source, ...]]]:
    """Return what a table writes in every row and the sources that it stands for; places that differ stand apart."""
    found = list[tuple[Source, tuple[Source, ...]]]()
    for row, members in groupby(sources, key=lambda own: own.row or own.name):
        first, *others = own = tuple(members)
        alike = all(replace(one, name=first.name, part=first.part) == first for one in others)
        if not first.row:
            found.append((first, own))
        elif alike and first.places == len(own):
            part = row if first.part == first.name else first.part
            found.append((replace(first, name=row, part=part, row=""), own))
        else:
            found += [(one.alone, (one,)) for one in own]
    return found


@dataclass(frozen=True, kw_only=True)
class Source:
    """One tolerance on a drawing, and the columns of the model that it moves.

    What stands here without a word is as `tolalloc.drawings.fields.ToleranceRow` says.
    """

    name: str  # Identifier; a column is this name, or this name and a component
    part: str
    feature: Feature
    zone: float  # Width, diameter, total pitch deviation or indicator reading of the zone [m]
    # Smallest and largest zone that may be asked for [m]
    minimum: float
    maximum: float
    cost: float  # Cost of the feature at its zone [cost units]
    middle: float = 0.0  # Middle of the zone as a deviation from the nominal size, for sizes only [m]
    nominal: float = 0.0  # Nominal size, for the drawing and its grades only [m]
    distribution: Distribution = Distribution.NORMAL
    # Process capability; at 1, 99.73 % of parts lie in the zone, or all where the distribution is bounded [-]
    cp: float = 1.0
    shift: float = 0.0  # Mean shift over half the zone, for sizes only [-]
    # Shape of a lognormal, Weibull or trapezoidal distribution, both of a beta distribution, else 0 [-]
    shape: float | tuple[float, ...] = 0.0
    batches: tuple[Batch, ...] = ()
    measured: MeasuredParts | None = None
    sorted: bool = False
    process: str = ""
    spectrum: Spectrum = ()  # Order → relative amplitude of pitch and run-out deviations [-]
    # Waves that all parts share beside the random ones inside the zone, of orders of the spectrum [-, m, rad]
    systematic: Systematic = ()
    teeth: int = 0  # Number of teeth on which the range of the spectrum is taken; 0: over the whole turn [-]
    written_spectrum: str = ""
    each: int = 1  # Number of like features (pins, teeth) that each deviate on their own inside this zone [-]
    over: float = 0.0  # For an angle, the length over which the zone limits the deviation; 0 for everything else [m]
    step: float = 0.0  # Step of the numbers that the drawing states; 0: the usual one, if its model has such [m]
    group: str = ""
    locked: bool = False
    grade: str = ""
    drawing: str = ""
    label: str = ""
    own_id: str = ""  # What the user's table calls it, if that is not its name
    note: str = ""
    uncertainty: float = 0.0  # Expanded uncertainty (k = 2) of its gauge, 0 where nobody says [m]
    provenance: str = ""  # How zone, range and cost are known, as the table states it
    # Head and cell of every column of the user's own that is none of a tolerance table; kept, and written again
    own_cells: tuple[tuple[str, str], ...] = ()
    # Unit in which the user's table states its zone: µm, mm, in, or % of the nominal size. It changes nothing that is
    # computed but the inputs of an own function, which knows it
    unit: str = field(default="µm", repr=False)
    # Like places that its row stands for, 0 where it does not say; and what the row calls all of them together, of a
    # source that is one of them
    places: int = field(default=0, repr=False)
    row: str = field(default="", repr=False)

    @property
    def is_of_places(self) -> bool:
        """Whether it stands for several like places, whose names a model knows."""
        return not self.row and (self.places > 1 or "*" in self.name)

    @property
    def known_from(self) -> dict[str, str]:
        """Cell (zone, range, cost) → how it is known, as far as the row or its note says."""
        return provenance_of(self.provenance, self.note)

    @property
    def is_resolved(self) -> bool:
        """Whether its gauge resolves its zone, as far as one is stated."""
        return self.zone >= RESOLVED * self.uncertainty * (1 - _ROUNDING)

    @property
    def alone(self) -> Source:
        """The same with a row of its own, whose id cannot be that of the row for several."""
        return replace(self, row="", places=0, own_id="", label=self.label or self.own_id)

    def at_places(self, names: Iterable[str]) -> tuple[Source, ...]:
        """Return the source of each of these names that its pattern means, or its name if they lose their numbers."""
        own = replace(self, row=self.name, group=self.group or self.own_id or self.name)
        return tuple(
            replace(own, name=name, part=name if self.part == self.name else self.part)
            for name in names
            if self.is_of_places and (_of_names(self.name).fullmatch(name) or re.sub(r"\d+", "", name) == self.name)
        )

    @property
    def length_name(self) -> str:
        """Unit of its nominal size in a table, and of the input of an own function that it is: mm or in."""
        return INCHES if self.unit == INCHES else "mm"

    @property
    def unit_length(self) -> float:
        """One unit of its row [m]."""
        return abs(self.nominal) / 100.0 if self.unit == PERCENT else LENGTHS[self.unit]

    def said(self, length: float, spec: str = ".3g") -> str:
        """Return a deviation as a sentence says it: in inches where its row does, else in micrometres."""
        text = f"{length / LENGTHS[self._told]:{spec}}"
        if "e+" in text:
            text = f"{float(text):{'+' * spec.startswith('+')},.0f}"
        return f"{text} {self._told}"

    @property
    def _told(self) -> str:
        """Unit in which sentences say a deviation."""
        return INCHES if self.unit == INCHES else "µm"

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the model's columns that this source moves."""
        names = [f"{self.name}.{number + 1}" for number in range(self.each)] if self.each > 1 else [self.name]
        if self.feature is Feature.SIZE:
            return tuple(names)
        if self.feature is Feature.POSITION:
            return tuple(f"{name}.{axis}" for name in names for axis in ("x", "y"))
        return tuple(f"{self.name}.{wave}{order}" for order, _ in self.spectrum for wave in ("cos", "sin"))

    @property
    def dimension(self) -> str:
        """The dimension of the drawing that it belongs to: its group, or itself if it has none."""
        return self.group or self.name

    @property
    def stated(self) -> tuple[object, ...]:
        """What the drawing states of its zone, its limits and its price: copies of one feature have it alike."""
        return (
            self.feature,
            *(self.zone, self.minimum, self.maximum, self.cost),
            *(self.middle, self.nominal, self.over, self.step),
            *(self.process, self.locked, self.drawing),
        )

    def rounded_down(self, zone: float, usual: Sequence[tuple[float, float]] = STEPS) -> float:
        """Return the widest zone in steps of the drawing that is no wider than one, and no smaller than allowed [m].

        A size has its step in each of its two deviations. A zone within a step of the smallest one becomes that one.
        """
        sides = 2 if self.feature is Feature.SIZE else 1
        # What a solver left a hair below a whole step is that step.
        return max(sides * rounded_down(zone / sides, self.step, usual), min(self.minimum, zone))

    @cached_property
    def middles(self) -> Float[np.ndarray, " column"]:
        """Where the columns stand without what is random: the middle of the zone, or the systematic waves [m, rad].

        Of a wave A·cos(n·(θ − θ0)) they are A·cos(n·θ0) and A·sin(n·θ0), own derivation.
        """
        if not self.systematic:
            return np.full(len(self.columns), self.middle / self.lever)
        waves = {order: amplitude * np.exp(1j * order * at) for order, amplitude, at in self.systematic}
        shared = np.array([waves.get(order, 0.0) for order, _ in self.spectrum])
        return np.stack([shared.real, shared.imag], axis=1).ravel()

    @property
    def lever(self) -> float:
        """What divides a length inside the zone to give the column: 1, or the length that an angle is taken over."""
        return self.over or 1.0

    @property
    def shapes(self) -> tuple[float, ...]:
        """Shapes of the distribution, none where it has none [-]."""
        return self.shape if isinstance(self.shape, tuple) else (self.shape,) if self.shape else ()

    @property
    def _base(self) -> Marginal:
        """Deviation of a size, from the middle of its zone or its lower limit; radius or amplitude of all others."""
        is_size = self.feature is Feature.SIZE
        normal = NORMAL if is_size else RAYLEIGH
        if self.measured:
            return normal if self.measured.is_normal else self.measured.smoothed
        if self.distribution is Distribution.MIXTURE:
            return Mixture(normal, self.batches)
        if self.distribution in (Distribution.NORMAL, Distribution.RAYLEIGH):
            return normal if self.distribution is Distribution.NORMAL else RAYLEIGH
        return self.distribution.form.of(self.shapes, start=-1.0 if is_size else 0.0)

    @cached_property
    def zone_mapping(self) -> ZoneMapping:
        """Distribution of the columns per unit of zone."""
        normal = self.measured if self.measured and self.measured.is_normal else None
        return ZoneMapping(
            feature=self.feature,
            distribution=self.distribution,
            base=self._base,
            cp=normal.cp if normal else self.cp,
            shift=normal.shift if normal else self.shift,
            spectrum=self.spectrum,
            teeth=self.teeth,
            sorted=self.sorted,
        )

    def standard_values(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return the columns per unit of zone for independent uniform numbers in (0, 1)."""
        own = uniform.reshape(uniform.shape[0] * self.each, -1)
        return np.asarray(self.zone_mapping.standard_values(own).reshape(uniform.shape) / self.lever)

    def at_limit(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return columns per unit of zone that fill the zone exactly, for independent uniform numbers in (0, 1)."""
        own = uniform.reshape(uniform.shape[0] * self.each, -1)
        return np.asarray(self.zone_mapping.at_limit(own).reshape(uniform.shape) / self.lever)

    @property
    def mapping(self) -> str:
        """Sentence that says how the zone became a distribution."""
        reading = f"{self.said(self.zone)}, {self.feature.zone_meaning}"
        if self.unit == PERCENT:
            reading = f"{self.zone / self.unit_length:.3g} % of the nominal size, {reading}"
        if self.teeth:
            reading += f", taken at {self.teeth} teeth"
        if self.over:
            reading += f" over a length of {self.over / LENGTHS[self.length_name]:g} {self.length_name}"
        if abs(self.middle) > _WRITTEN * self.zone:
            reading += f", its middle {self.said(self.middle, '+.3g')} from the nominal size".replace("-", "−")
        for order, amplitude, at in self.systematic:
            reading += (
                f", beside a wave of order {order} that all parts share, {self.said(amplitude)} high at "
                f"{degrees(at):.3g}°"
            )
        if self.each > 1:
            reading += f", each of {self.each} on its own"
        is_normal = self.distribution is Distribution.NORMAL and not self.sorted
        process = f"; process {self.process}" if self.process else ""
        return f"{reading}: {self._normal if is_normal else self._other}{process}"

    @property
    def _normal(self) -> str:
        """What the zone became, where it became normal numbers."""
        deviation = self.zone_mapping.wave_deviation * self.zone
        if self.teeth:
            return (
                f"normal, σ = {self.said(deviation)} per unit of the spectrum {self.written_spectrum} at Cp {self.cp:g}"
            )
        if self.spectrum:
            sizes = (
                f"{self.said(deviation * amplitude).split()[0]} (order {order})" for order, amplitude in self.spectrum
            )
            return f"normal cosine and sine waves, σ = {', '.join(sizes)} {self._told} at Cp {self.cp:g}"
        if self.feature is Feature.POSITION:
            return f"normal, σ = {self.said(deviation)} on each axis at Cp {self.cp:g}"
        shift = f", mean shifted by {self.said(self.shift * self.zone / 2)}" if self.shift else ""
        return f"normal, σ = {self.said(deviation)} at Cp {self.cp:g}{shift}"

    @property
    def _other(self) -> str:
        """What the zone became, where it became anything else."""
        mean, deviation = (number * self.zone for number in self.zone_mapping.moments)
        if self.feature is Feature.SIZE:
            off = self.said(mean, "+.3g") if abs(mean) > _WRITTEN * self.zone else self.said(0.0)
            spread = f"{self._kind}, mean {off} off the middle, σ = {self.said(deviation)}"
        elif self.feature is Feature.POSITION:
            spread = f"radius {self._kind}, mean {self.said(mean)}, σ = {self.said(deviation)}, any phase"
        else:
            length = LENGTHS[self._told]
            waves = ", ".join(
                f"{mean * amplitude / length:.3g} ± {deviation * amplitude / length:.3g} (order {order})"
                for order, amplitude in self.spectrum
            )
            spread = f"amplitude of every order {self._kind}, mean ± σ = {waves} {self._told}, any phase"
        if self.distribution is not Distribution.EMPIRICAL:
            spread += f", at Cp {self.cp:g}"
        if len(self.spectrum) > 1:
            return spread
        inside = 100.0 * self.zone_mapping.inside
        kept = f", the other {100.0 - inside:.2g} % sorted out" if self.sorted else ""
        return f"{spread}, {inside:.4g} % of all parts inside the zone{kept}"

    @property
    def _kind(self) -> str:
        """The distribution with its parameters."""
        if self.measured:
            return self.measured.sentence
        if self.batches:
            return "mixture of batches " + ", ".join(
                f"{batch.weight:g} of all with shift {batch.shift:g} and spread {batch.spread:g}"
                for batch in self.batches
            )
        shapes = " and ".join(f"{own:g}" for own in self.shapes)
        if len(self.shapes) > 1:
            return f"{self.distribution.value}, shapes {shapes}"
        return f"{self.distribution.value}, shape {shapes}" if shapes else self.distribution.value


def limited_measure(source: Source, columns: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, " sample"]:
    """Return what a gauge would show of a source for its own columns, in such a way that it compares with the zone [m].

    Systematic waves are taken off. A size: its deviation from the middle, for like features the largest magnitude. A
    position: twice the distance from the true one, the largest of like features. Pitch and run-out: the range over a
    turn, or at the teeth for a spectrum with a random part.
    """
    length = columns * source.lever - (source.middles if source.systematic else source.middle)
    if source.feature is Feature.SIZE:
        return np.asarray(np.abs(length).max(axis=1) if source.each > 1 else length[:, 0])
    if source.feature is Feature.POSITION:
        return np.asarray(2.0 * np.hypot(length[:, 0::2], length[:, 1::2]).max(axis=1))
    orders = np.array([order for order, _ in source.spectrum])
    high, low = np.full(length.shape[0], -np.inf), np.full(length.shape[0], np.inf)
    points = source.teeth or _POINTS_PER_WAVE * int(orders.max())
    # Point by point, because all points of many units at once would fill the memory.
    for turn in np.linspace(0.0, 2 * np.pi, points, endpoint=False):
        wave = length @ np.column_stack([np.cos(orders * turn), np.sin(orders * turn)]).ravel()
        high, low = np.maximum(high, wave), np.minimum(low, wave)
    return np.asarray(high - low)


def zone_unit(sources: Iterable[Source]) -> str:
    """Return the unit in which a report shows zones: in or % where all sources are stated so, else µm."""
    stated = {own.unit for own in sources}
    return stated.pop() if len(stated) == 1 and stated <= {INCHES, PERCENT} else "µm"


def length_unit(sources: Iterable[Source]) -> tuple[str, float]:
    """Return the unit in which a report shows lengths of zones, and its length [m]: in where all are stated so."""
    unit = INCHES if zone_unit(sources) == INCHES else "µm"
    return unit, LENGTHS[unit]


def zone_in(source: Source, unit: str, zone: float | None = None) -> float:
    """Return the zone of a source, or another one [m], in such a unit."""
    length = source.unit_length if unit == PERCENT else LENGTHS[unit]
    return (source.zone if zone is None else zone) / length
