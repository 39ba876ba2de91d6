"""From a source to what a drawing says of it: characteristic, zone as it is written, and datum."""

from __future__ import annotations

from fnmatch import fnmatchcase
from math import ceil, floor

from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reports.feature_frame import FeatureFrame

STEP = 0.1 * MICROMETRE
"""Step in which a drawing writes a zone [m]."""
_ROUNDING = 1e-6
"""Part of a step that a zone may lack and still count as whole [-]."""

_CHARACTERISTICS = (
    (Feature.SIZE, "*.tilt", "parallelism", "a tilt is drawn as parallelism of the axis over its length"),
    (Feature.POSITION, "*.tilt", "parallelism", "a tilt is drawn as parallelism of the axis over its length"),
    (Feature.SIZE, "*.rotation", "position", "a rotation of a pattern is drawn as the position of its features"),
    (Feature.SIZE, "*.phase", "position", "a phase of a journal is drawn as its position about the axis"),
    (Feature.POSITION, "carrier.assembly", "coaxiality", "how far an assembly stands off is drawn as coaxiality"),
    (Feature.POSITION, "sun.assembly", "coaxiality", "how far an assembly stands off is drawn as coaxiality"),
    (Feature.POSITION, "sun.eccentricity", "coaxiality", "the eccentricity of a gear is drawn as its coaxiality"),
    (Feature.POSITION, "planet*.eccentricity", "coaxiality", "the eccentricity of a gear is drawn as its coaxiality"),
    (Feature.POSITION, "*", "position", ""),
    (Feature.RUNOUT, "*", "circular run-out", ""),
    (Feature.PITCH, "*", "cumulative pitch", ""),
    (Feature.SIZE, "*", "size", ""),
)
"""Feature, name of the source, characteristic on the drawing, what of that is assumed; the first that fits counts."""


def _found(source: Source) -> tuple[str, str]:
    """Return the characteristic of a source, and what of it is assumed."""
    return next(
        (characteristic, assumed)
        for feature, pattern, characteristic, assumed in _CHARACTERISTICS
        if feature is source.feature and fnmatchcase(source.name, pattern)
    )


def written(length: float) -> str:
    """Return a width as a drawing writes it [mm], rounded down to 0.1 µm so that nothing wider is allowed.

    >>> written(4.7503e-6), written(10e-6), written(0.5e-6)
    ('0.0047', '0.01', '0.0005')
    """
    steps = floor(length / STEP + _ROUNDING)
    return f"{steps * STEP / MILLIMETRE:.4f}".rstrip("0").rstrip(".") or "0"


def callout(source: Source) -> FeatureFrame:
    """Return what stands on the drawing for a source.

    References
    ----------
    ISO 1101 (symbols), ISO 1328-1 (total cumulative pitch deviation), ISO 129-1 (limit deviations).
    """
    characteristic, _ = _found(source)
    exact = f"{source.zone / MICROMETRE:.6g} µm"
    if characteristic == "size":
        return FeatureFrame("size", _deviations(source), exact=exact)
    round_zone = source.feature is Feature.POSITION
    over = f"/{source.over / MILLIMETRE:g}" if source.over else ""
    datums = () if characteristic == "cumulative pitch" else ("A",)
    return FeatureFrame(characteristic, f"{'⌀' if round_zone else ''}{written(source.zone)}{over}", datums, exact)


def _deviations(source: Source) -> str:
    """Return the limit deviations of a size [mm]; half a zone is rounded, so that both sides are alike."""
    if source.middle == 0.0:
        return f"±{written(source.zone / 2)}"
    upper = floor((source.middle + source.zone / 2) / STEP + _ROUNDING)
    lower = ceil((source.middle - source.zone / 2) / STEP - _ROUNDING)
    return " / ".join(
        f"{'−' if steps < 0 else '+' if steps else ''}{written(abs(steps) * STEP)}" for steps in (upper, lower)
    )


def callout_assumptions(sources: tuple[Source, ...]) -> tuple[str, ...]:
    """Return what the frames of some sources take for granted."""
    said = [assumed for _, assumed in map(_found, sources) if assumed]
    if any(callout(source).datums for source in sources):
        said.append("datum A of a frame is the axis that centres or turns its part; the tolerance table names no datum")
    return tuple(dict.fromkeys(said))
