"""Where each source of a drawing sits: the places of the picture, and which sources belong to which of them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from tolalloc.exceptions import UnknownNameError
from tolalloc.reducers.reducer.design import Reducer

_RULES = (
    (r"each_pin\.diameter|pin\..+", "pins"),
    (r"each_pin\.groove|housing\.groove\..+", "housing.grooves"),
    (r"each_pin\.position|housing\.(?:pitch|runout)", "housing.pins"),
    (r"(sun|planet\d+|disc\d+)\.(?:each_tooth\..+|pitch|runout)", r"\1.teeth"),
    (r"(sun|planet\d+|carrier|crank\d+|disc\d+)\.(?:assembly|eccentricity|tilt|clearance)", r"\1"),
    (r"(mesh\d+)\..+", r"\1"),
    (r"(disc\d+\.bore\d+|crank\d+\.journal\d+|carrier\.bore\d+|disc\d+\.bores)\..+", r"\1"),
)
"""Name of a source → the place that it sits at."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """A feature of a part that the picture shows and that sources of the drawing limit."""

    id: str  # Name of the feature, the beginning of its sources' names where they share one
    label: str  # What a reader calls it
    part: str  # Part that carries it
    sources: tuple[str, ...] = ()  # Names of the drawing's sources that sit there


def place_of(source: str) -> str:
    """Return the id of the place that a source sits at.

    Raises
    ------
    UnknownNameError
        A name that no reducer has.

    Examples
    --------
    >>> place_of("disc2.each_tooth.pitch"), place_of("crank1.journal2.phase"), place_of("carrier.tilt")
    ('disc2.teeth', 'crank1.journal2', 'carrier')
    """
    for pattern, place in _RULES:
        match = re.fullmatch(pattern, source)
        if match:
            return match.expand(place)
    raise UnknownNameError.among("places of a reducer", "source", source, [pattern for pattern, _ in _RULES])


def is_placed(source: str) -> bool:
    """Return whether the picture has a place for a source, as it has for all of this package."""
    return any(re.fullmatch(pattern, source) for pattern, _ in _RULES)


def places_of(reducer: Reducer, sources: Iterable[str] = ()) -> tuple[Place, ...]:
    """Return all places of a reducer with the sources of a drawing, from the inside of the housing to the input.

    Raises
    ------
    UnknownNameError
        A source that sits at no part of the reducer.
    """
    found = {place.id: place for place in _all_places(reducer)}
    for source in sources:
        own = place_of(source)
        if own not in found:
            raise UnknownNameError.among(f"places of {reducer.name}", "source", source, found)
        found[own] = replace(found[own], sources=(*found[own].sources, source))
    return tuple(found.values())


def _all_places(reducer: Reducer) -> Iterable[Place]:
    cranks, discs = range(1, reducer.crank_count + 1), range(1, reducer.disc_count + 1)
    yield Place(id="housing.pins", label="places of the pins in the housing", part="housing")
    yield Place(id="housing.grooves", label="grooves of the pins", part="housing")
    yield Place(id="pins", label="pins", part="pins")
    for disc in discs:
        yield Place(id=f"disc{disc}", label=f"disc {disc}", part=f"disc{disc}")
        yield Place(id=f"disc{disc}.teeth", label=f"teeth of disc {disc}", part=f"disc{disc}")
        yield Place(id=f"disc{disc}.bores", label=f"pattern of the bores of disc {disc}", part=f"disc{disc}")
        for crank in cranks:
            yield Place(id=f"disc{disc}.bore{crank}", label=f"bore {crank} of disc {disc}", part=f"disc{disc}")
    for crank in cranks:
        yield Place(id=f"crank{crank}", label=f"crankshaft {crank}", part=f"crank{crank}")
        for disc in discs:
            label = f"journal {disc} of crankshaft {crank}"
            yield Place(id=f"crank{crank}.journal{disc}", label=label, part=f"crank{crank}")
    yield Place(id="carrier", label="carrier", part="carrier")
    for crank in cranks:
        yield Place(id=f"carrier.bore{crank}", label=f"bore {crank} of the carrier", part="carrier")
    yield Place(id="sun", label="sun gear", part="sun")
    yield Place(id="sun.teeth", label="teeth of the sun gear", part="sun")
    for crank in cranks:
        yield Place(id=f"planet{crank}", label=f"planet gear {crank}", part=f"planet{crank}")
        yield Place(id=f"planet{crank}.teeth", label=f"teeth of planet gear {crank}", part=f"planet{crank}")
        yield Place(id=f"mesh{crank}", label=f"mesh of sun and planet {crank}", part=f"planet{crank}")
