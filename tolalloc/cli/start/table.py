"""The tolerance table of a new folder: every source of the reducer, with zones that fit its size."""

from __future__ import annotations

import re
from dataclasses import replace

from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Reducer

_FIRST_STAGE = re.compile(r"sun\.|planet\d|mesh\d")
_FINE = re.compile(r".*(\.phase|\.rotation|\.tilt|each_pin\..*|\.each_tooth\..*|\.clearance)$")
"""Sources that a first study neglects: they stand in the table with a zone of 0 and locked."""
_NUMBERED = re.compile(r"(disc|crank|bore|journal|planet|mesh)\d+")
_KNOWN_DIAMETER = 104.0
"""Diameter of the pin circle of the RV-20E, whose zones are the shipped ones [mm]."""


def sources_of(reducer: Reducer) -> tuple[Source, ...]:
    """Return all sources of a reducer with assumed zones.

    Zones and their ranges are those of the shipped RV-20E, scaled by the tolerance unit i = 0.45·D^(1/3) + 0.001·D of
    ISO 286-1 with D the diameter of the pin circle in mm. The first stage is locked.
    """
    known = {source.name: source for source in load_tolerance_table("rv20e_all_sources")}
    scale = size_factor(2 * reducer.cycloid_stage.pin_circle_radius / MILLIMETRE)
    names = dict.fromkeys(map(source_name, EquivalentModel(reducer).columns))
    found = []
    for name in names:
        like = known.get(name) or known.get(_NUMBERED.sub(r"\g<1>1", name))
        if like is not None:
            found.append(_scaled(replace(like, name=name, part=name.partition(".")[0]), reducer, scale))
    return tuple(sorted(found, key=lambda own: bool(_FINE.match(own.name)) + 2 * bool(_FIRST_STAGE.match(own.name))))


def size_factor(diameter: float) -> float:
    """Return how much wider zones are on a pin circle of a diameter [mm] than on that of the RV-20E [-].

    >>> size_factor(104.0), round(size_factor(155.0), 3)
    (1.0, 1.154)
    """

    def unit(size: float) -> float:
        return float(0.45 * size ** (1 / 3) + 0.001 * size)

    return unit(diameter) / unit(_KNOWN_DIAMETER)


def _scaled(source: Source, reducer: Reducer, scale: float) -> Source:
    """Return a source at this size, its number of like features that of the reducer."""
    stage = reducer.cycloid_stage
    each = source.each if source.each == 1 else stage.pin_count if "each_pin" in source.name else stage.disc_teeth
    nominal = {"pin.diameter": 2 * stage.pin_radius, "housing.groove.radius": stage.pin_radius}.get(source.name, 0.0)
    zone, least, most = (_rounded(scale * own) for own in (source.zone, source.minimum, source.maximum))
    note = "zone, range and cost assumed: those of the RV-20E, scaled by ISO 286's tolerance unit"
    own = replace(source, zone=zone, minimum=least, maximum=most, each=each, nominal=nominal, note=note)
    if _FINE.match(source.name):
        return replace(own, zone=0.0, minimum=0.0, maximum=0.0, cost=0.0, locked=True, note="neglected: give it a zone")
    if _FIRST_STAGE.match(source.name):
        return replace(own, locked=True, note=f"{note}; locked: the first stage is divided by the ratio")
    return own


def _rounded(length: float) -> float:
    """Return a length in whole tenths of a micrometre [m]."""
    return round(length / MICROMETRE, 1) * MICROMETRE
