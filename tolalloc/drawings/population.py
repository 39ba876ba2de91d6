"""Populations of the parts that a zone lets through: what a drawing promises for, and what it demands for that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError

Population = str | float
"""How parts lie in their zones: `STATED`, `EVENLY`, `ANYWHERE`, or a Cp about the middle [-]."""
STATED, EVENLY, ANYWHERE = "", "uniform", "none"
"""As the table states it of each row; spread evenly over the zone; anywhere in it, all parts at one limit too."""

_CP = (0.1, 10.0)
"""Capabilities that are believed, as those of a tolerance table [-]."""


def require_population(population: Population, place: str) -> None:
    """Raise unless it is one of the names, or a Cp.

    Raises
    ------
    InputError
        What is allowed.
    """
    is_cp = isinstance(population, int | float) and not isinstance(population, bool)
    if population in (STATED, EVENLY, ANYWHERE) if not is_cp else _CP[0] <= float(population) <= _CP[1]:
        return
    allowed = f"'{EVENLY}', '{ANYWHERE}', or a Cp from {_CP[0]:g} to {_CP[1]:g}; nothing for the table's own"
    raise InputError.at(place, "population", population, allowed)


def populated(errors: ErrorModel, population: Population) -> ErrorModel:
    """Return the error model with parts that lie in every zone as a population does.

    Notes
    -----
    Spread evenly: the deviation of a size over its zone, the radius of a position and the amplitude of each wave from 0
    to its largest; pitch and run-out with a random part stay normal, with the same variance per unit of zone as an even
    spread of a size, Cp = 1/√3 (own derivation: zone/(6·Cp) = zone/√12; an assumption for waves). Parts anywhere in
    their zones have no distribution: what is promised of them is promised of the worst unit, and their rows stay.
    """
    if population in (STATED, ANYWHERE):
        return errors
    sources = tuple(_populated(own, population) if own.zone > 0.0 else own for own in errors.sources)
    return replace(errors, sources=sources)


def _populated(source: Source, population: Population) -> Source:
    kind, capability = Distribution.NORMAL, _EVEN_AS_NORMAL
    if population != EVENLY:
        capability = float(population)
    elif not source.teeth:
        kind, capability = Distribution.UNIFORM, 1.0
    plain = replace(source, shape=0.0, batches=(), measured=None, sorted=False)
    return replace(plain, distribution=kind, cp=capability, shift=0.0)


_EVEN_AS_NORMAL = 3.0**-0.5
"""Cp of a normal distribution with the variance of an even spread [-]."""


def taken_as(population: Population) -> str:
    """Return how parts are taken to lie in their zones, in a sentence, for a population other than the table's."""
    if population == EVENLY:
        return (
            "Parts are taken to spread evenly over every zone, whatever capability and distribution the table states."
        )
    if population == ANYWHERE:
        return "Parts may lie anywhere in their zones, so the drawing is judged by the worst unit inside them."
    return f"Parts are taken to keep Cp {population:g} about the middle of every zone, whatever the table states."


def demand(source: Source) -> str:
    """Return what a line demands of the population of its parts beside its zone, in a drawing's words.

    What the promise of a drawing rests on: capability, where the mean lies, and the distribution where it is no normal
    one.

    References
    ----------
    ISO 18391:2016, Population specification, whose idea this is; its symbols are not drawn.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from tolalloc.drawings.drawing import load_drawing
    >>> pin = next(own for own in load_drawing("rv20e_drawing").sources if own.name == "pin.diameter")
    >>> demand(pin), demand(replace(pin, distribution=Distribution.UNIFORM))
    ('Cp ≥ 1, centred', 'no more than evenly spread')
    """
    if source.measured:
        return f"as the parts of {source.measured.path.name}"
    if source.distribution is Distribution.UNIFORM and source.cp <= 1.0:
        return "no more than evenly spread"
    said = [f"Cp ≥ {source.cp:.3g}"]
    if source.feature is Feature.SIZE and not source.distribution.form.is_one_sided and not source.batches:
        side = "above" if source.shift > 0 else "below"
        off = f"mean {abs(source.shift):.0%} of the half zone {side} its middle"
        said.append(off if source.shift else "centred")
    if source.batches:
        said = ["batches as stated"]
    elif source.distribution is not Distribution.NORMAL:
        said.append(source.distribution.value)
    if source.sorted:
        said.append("all parts inspected")
    return ", ".join(said)


def demanded_capabilities(sources: Sequence[Source]) -> tuple[float, float] | None:
    """Return the smallest and the largest Cp that the lines demand, where all demand no more than to be centred [-].

    None where one demands a mean off the middle, another distribution than the normal one, or what was measured.
    """
    drawn = [own for own in sources if own.zone > 0.0]
    plain = all(own.distribution is Distribution.NORMAL and not (own.shift or own.sorted) for own in drawn)
    return (min(own.cp for own in drawn), max(own.cp for own in drawn)) if drawn and plain else None
