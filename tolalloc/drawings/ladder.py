"""Standard tolerances: the zones that a drawing may carry, grades or preferred numbers, and the deviations of a fit.

Notes
-----
Sizes up to 500 mm climb the standard tolerance grades of ISO 286-1. A drawing means the printed value. The standard
derives it, from the geometric mean D of the size step's ends [mm] (1 and 3 mm for the first) and from
i = 0.45·∛D + 0.001·D [µm]:

* IT01, IT0, IT1: 0.3 + 0.008·D, 0.5 + 0.012·D, 0.8 + 0.020·D [µm];
* IT5 to IT11: 7, 10, 16, 25, 40, 64 and 100 times i; IT2 to IT4 in geometric progression between IT1 and IT5;
* every grade from IT12 on: ten times the grade five below.

It then rounds by hand: IT7 of the first step is 10 µm where its formula gives 8.7 µm. From IT5 on the printed values
are up to 16 % off their formula, below it up to 29 %, so the table stands here as data.

A callout without a nominal size, such as position, pitch, run-out and radii, climbs the rounded values of ISO 3, R′10,
which a drawing can carry: 3.2 where R10 itself has 3.15. One step is 26 %, about what a shop's cost tells apart; with
the customary 1–2–5 a step is 100 % or 150 %, and rounding a zone down to it gives away up to 60 % of that zone; with
R′20 a step is 12 %, and ladders double their length for savings below the uncertainty of any cost.

References
----------
ISO 286-1, Geometrical product specifications: ISO code system for tolerances on linear sizes.
ISO 3, Preferred numbers: Series of preferred numbers; ISO 497, more rounded values.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError
from tolalloc.reading.units import MICROMETRE, MILLIMETRE

SIZE_STEPS = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Largest nominal size of every size step [mm]."""

PRINTED = {
    "IT01": (0.3, 0.4, 0.4, 0.5, 0.6, 0.6, 0.8, 1, 1.2, 2, 2.5, 3, 4),
    "IT0": (0.5, 0.6, 0.6, 0.8, 1, 1, 1.2, 1.5, 2, 3, 4, 5, 6),
    "IT1": (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8),
    "IT2": (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10),
    "IT3": (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15),
    "IT4": (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    "IT5": (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    "IT6": (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    "IT7": (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    "IT8": (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    "IT9": (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    "IT10": (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    "IT11": (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
}
"""Zone of every grade in every size step, up to the grade from which on they repeat tenfold [µm]."""

GRADES = (*PRINTED, *(f"IT{number}" for number in range(12, 19)))

_COARSE = frozenset(("IT14", "IT15", "IT16", "IT17", "IT18"))
"""Grades that the standard does not allow up to 1 mm."""

_ROUNDING = 1e-9
"""What a number may lose between units, and a zone on its way through a table [-]."""
_SHAFTS = {
    "d": (-20, -30, -40, -50, -65, -80, -100, -120, -145, -170, -190, -210, -230),
    "e": (-14, -20, -25, -32, -40, -50, -60, -72, -85, -100, -110, -125, -135),
    "f": (-6, -10, -13, -16, -20, -25, -30, -36, -43, -50, -56, -62, -68),
    "g": (-2, -4, -5, -6, -7, -9, -10, -12, -14, -15, -17, -18, -20),
    "h": (0,) * 13,
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
"""Fundamental deviation of a shaft in every size step, of d to h the upper one, of the others the lower one; of k from
IT4 to IT7, 0 in other grades [µm]."""
_FIT = re.compile(r"(js|JS|[A-Za-z])\s?(\d{1,2})|IT\s?(\d{1,2})")
_FINEST = 3
"""Finest grade of a hole K to P [-]."""
_CORRECTED = {"K": 8, "M": 8, "N": 8, "P": 7}
"""Holes of these letters are a step of grades tighter than the shafts that they mirror, up to this grade."""
_OF_K = range(4, 8)
_FITS = "d to h, js, k, m, n and p, the same of holes in capitals, or IT, with a grade, such as h5, H7 or IT6"
SERIES = "R′10"
_DECADE = (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.3, 8.0)
"""Its values within one decade [-]."""
ZONES = np.array([*(float(f"{value}e{power}") for power in range(-1, 3) for value in _DECADE), 1000.0]) * MICROMETRE
"""All zones from 0.1 µm to 1 mm [m]."""
RADII = ("radius", "groove")
"""Last part of the name of a size that is a radius. ISO 286 grades diameters and widths; read for the
number of a radius, a grade would be one of a feature half as large."""


def _size_step(nominal: float) -> int:
    """Return the position of the size step of a nominal size [m]; one outside 0 to 500 mm is an InputError."""
    size = nominal / MILLIMETRE
    if not 0 < size <= SIZE_STEPS[-1] * (1 + _ROUNDING):
        raise InputError.at("ISO 286-1", "nominal [mm]", size, f"a number above 0 and up to {SIZE_STEPS[-1]}")
    return bisect_left(SIZE_STEPS, size * (1 - _ROUNDING))


def tolerance_factor(nominal: float) -> float:
    """Return the standard tolerance factor of ISO 286-1, i = 0.45·D^⅓ + 0.001·D in µm for D in mm [m].

    Zones of IT6 are 10·i and of IT16 1,000·i; a nominal size of 10 mm has i = 0.98 µm.
    """
    size = max(nominal / MILLIMETRE, 1.0)
    return float((0.45 * size ** (1 / 3) + 0.001 * size) * MICROMETRE)


def grade_zones(nominal: float) -> dict[str, float]:
    """Return the zone of every grade of a nominal size in metres, finest first [m]; printed values of ISO 286-1.

    As printed in ISO 286-1:2010; from IT12 on IT(n) = 10·IT(n − 5). For 0 to 500 mm.

    >>> round(grade_zones(0.052)["IT6"] * 1e6), round(grade_zones(0.052)["IT12"] * 1e6)
    (19, 300)
    """
    step = _size_step(nominal)
    zones = {grade: row[step] * MICROMETRE for grade, row in PRINTED.items()}
    for number in range(12, 19):
        zones[f"IT{number}"] = 10 * zones[f"IT{number - 5}"]
    too_small = nominal <= MILLIMETRE * (1 + _ROUNDING)
    return {grade: zone for grade, zone in zones.items() if not (too_small and grade in _COARSE)}


def is_fit(text: str) -> bool:
    """Return whether a cell is written as a fit of ISO 286, a letter and a grade."""
    return _FIT.fullmatch(text) is not None


def fit_deviations(fit: str, nominal: float) -> tuple[float, float]:
    """Return the upper and the lower deviation of a fit at a nominal size in metres [m]; ISO 286-2.

    A grade alone is taken to both sides alike. Of holes K, M, N and P the mirrored deviation is raised by the grade
    less the one below it; M6 from 250 to 315 mm is the standard's exception.

    Examples
    --------
    >>> [[round(one * 1e6, 1) for one in fit_deviations(fit, 0.040)] for fit in ("h6", "H7", "g6", "K7", "js9")]
    [[0.0, -16.0], [25.0, 0.0], [-9.0, -25.0], [7.0, -18.0], [31.0, -31.0]]
    """
    found = _FIT.fullmatch(fit)
    letter, grade = (found[1] or "js", found[2] or found[3]) if found else ("", "")
    step, zones = _size_step(nominal), grade_zones(nominal)
    width, small = zones.get(f"IT{grade}", 0.0), letter.lower()  # IT01 is another grade than IT1
    if not width or small not in (*_SHAFTS, "js"):
        raise InputError.at("ISO 286-2", "fit", fit, _FITS)
    if small == "js":
        return width / 2, -width / 2
    number = int(grade)
    own = _SHAFTS[small][step] if small != "k" or number in _OF_K or letter == "K" else 0
    size = own * MICROMETRE
    if letter == small:
        return (size, size - width) if small <= "h" else (size + width, size)
    if letter <= "H":
        return width - size, 0.0 - size
    if number < _FINEST:
        raise InputError.at("ISO 286-2", "fit", fit, f"{letter} from grade {_FINEST} on")
    if number <= _CORRECTED[letter]:
        raised = width - zones[f"IT{number - 1}"] if step else 0.0
        size -= raised if (fit, SIZE_STEPS[step]) != ("M6", 315) else raised + 2 * MICROMETRE
    elif letter == "K":
        raise InputError.at("ISO 286-2", "fit", fit, "K up to grade 8")
    elif letter == "N":
        size = 0.0 if step else size
    return 0.0 - size, 0.0 - size - width


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Increasing zones with the grade or the series of each."""

    zones: Float[np.ndarray, " step"]  # The zones, tightest first [m]
    labels: tuple[str, ...]  # Where each comes from: a grade, or the series of preferred numbers

    def __post_init__(self) -> None:
        zones = self.zones
        if not (zones.size and np.all(np.isfinite(zones)) and zones[0] > 0 and np.all(np.diff(zones) > 0)):
            listed = (zones / MICROMETRE).tolist()
            raise InputError.at("ladder", "zones [µm]", listed, "one number above 0 or more, each above the last")

    def within(self, minimum: float, maximum: float, place: str) -> Ladder:
        """Return the steps inside a range [m]; a range without a step is an InputError that names its place."""
        inside = (self.zones >= minimum * (1 - _ROUNDING)) & (self.zones <= maximum * (1 + _ROUNDING))
        if not inside.any():
            above = int(np.searchsorted(self.zones, minimum))
            nearest = range(max(above - 1, 0), min(above + 1, len(self.labels)))
            steps = " and ".join(f"{self.labels[at]} ({self.zones[at] / MICROMETRE:g} µm)" for at in nearest)
            limits = (round(minimum / MICROMETRE, 4), round(maximum / MICROMETRE, 4))
            allowed = f"a range that holds a step of its ladder, the nearest of which are {steps}"
            raise InputError.at(place, "min and max [µm]", limits, allowed)
        labels = tuple(label for label, kept in zip(self.labels, inside, strict=True) if kept)
        return Ladder(zones=self.zones[inside], labels=labels)


def group_ladder(sources: Sequence[Source]) -> Ladder:
    """Return the common ladder of sources that share one tolerance, none of them locked.

    A step is one zone for all of them, whatever the ratios of their zones in the table, and costs what they cost at it
    together. Grades serve members that are sizes of one size step; otherwise one grade would mean several zones.
    """
    place = f"group {sources[0].dimension}" if len(sources) > 1 else f"source {sources[0].name}"
    locked = [source.name for source in sources if source.locked]
    if locked:
        raise InputError.at(place, "locked members", locked, "none")
    graded = all(
        source.feature is Feature.SIZE and source.nominal > 0 and source.name.rsplit(".", 1)[-1] not in RADII
        for source in sources
    )
    if graded and len({_size_step(source.nominal) for source in sources}) == 1:
        zones = grade_zones(max(source.nominal for source in sources))
        ladder = Ladder(zones=np.array([*zones.values()]), labels=(*zones,))
    else:
        ladder = Ladder(zones=ZONES, labels=(SERIES,) * ZONES.size)
    minimum, maximum = max(source.minimum for source in sources), min(source.maximum for source in sources)
    return ladder.within(minimum, maximum, place)
