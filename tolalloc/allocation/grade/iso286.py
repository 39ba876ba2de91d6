"""Standard tolerance grades of ISO 286-1 for nominal sizes up to 500 mm, as the standard prints them.

Notes
-----
A drawing means the printed value. The standard derives it, from the geometric mean D of the size step's ends [mm]
(1 and 3 mm for the first) and from i = 0.45·∛D + 0.001·D [µm]:

* IT01, IT0, IT1: 0.3 + 0.008·D, 0.5 + 0.012·D, 0.8 + 0.020·D [µm];
* IT5 to IT11: 7, 10, 16, 25, 40, 64 and 100 times i; IT2 to IT4 in geometric progression between IT1 and IT5;
* every grade from IT12 on: ten times the grade five below.

It then rounds by hand: IT7 of the first step is 10 µm where its formula gives 8.7 µm. From IT5 on the printed values
are up to 16 % off their formula, below it up to 29 %, so the table stands here as data.

References
----------
ISO 286-1, Geometrical product specifications: ISO code system for tolerances on linear sizes.
"""

from __future__ import annotations

from bisect import bisect_left

from tolalloc.exceptions import InputError
from tolalloc.units import MICROMETRE, MILLIMETRE

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
"""Names of the grades, finest first."""

_COARSE = frozenset(("IT14", "IT15", "IT16", "IT17", "IT18"))
"""Grades that the standard does not allow up to 1 mm."""

_ROUNDING = 1e-9
"""What a number may lose between units [-]."""


def size_step(nominal: float) -> int:
    """Return the position of the size step of a nominal size [m]; one outside 0 to 500 mm is an InputError."""
    size = nominal / MILLIMETRE
    if not 0 < size <= SIZE_STEPS[-1] * (1 + _ROUNDING):
        raise InputError.at("ISO 286-1", "nominal [mm]", size, f"a number above 0 and up to {SIZE_STEPS[-1]}")
    return bisect_left(SIZE_STEPS, size * (1 - _ROUNDING))


def grade_zones(nominal: float) -> dict[str, float]:
    """Return the zone of every grade of a nominal size in metres, finest first [m]."""
    step = size_step(nominal)
    zones = {grade: row[step] * MICROMETRE for grade, row in PRINTED.items()}
    for number in range(12, 19):
        zones[f"IT{number}"] = 10 * zones[f"IT{number - 5}"]
    too_small = nominal <= MILLIMETRE * (1 + _ROUNDING)
    return {grade: zone for grade, zone in zones.items() if not (too_small and grade in _COARSE)}
