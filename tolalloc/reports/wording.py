"""How the name of an output, which carries its unit, is said in sentences; and words that not every reader knows."""

from __future__ import annotations

from collections.abc import Iterable

from tolalloc.reading.units import unit_of

QUICK_RUN = "Quick run: small samples, wide intervals. Run without --quick before setting a drawing."
"""What every answer of a quick run warns of."""

_SIGNS = {"arcsec": "″", "%": " %"}
_UNDERSTOOD = " transmission error"
"""What an engineer leaves out where nothing else is meant."""


def sign_of(unit: str) -> str:
    """Return what follows a number in a ranking: the unit's sign or, after a blank, the unit.

    >>> sign_of("arcmin"), sign_of("N")
    ('′', ' N')
    """
    return {**_SIGNS, "arcmin": "′", "deg": "°", "-": ""}.get(unit, f" {unit}")


def quantity(name: str) -> str:
    """Return the name of an output without its unit.

    >>> quantity("lost motion [arcmin]")
    'lost motion'
    """
    return name.split(" [")[0]


def short(name: str) -> str:
    """Return the shortest name of an output that is understood.

    >>> short("peak-to-peak transmission error [arcsec]")
    'peak-to-peak'
    """
    return quantity(name).removesuffix(_UNDERSTOOD)


def with_unit(text: str, name: str) -> str:
    """Return a number with the unit of an output as a sentence says it.

    >>> with_unit("60", "peak-to-peak transmission error [arcsec]"), with_unit("1", "lost motion [arcmin]")
    ('60″', '1 arcmin')
    """
    unit = unit_of(name)
    return f"{text}{_SIGNS[unit]}" if unit in _SIGNS else f"{text} {unit}".strip()


GLOSSARY = {
    "capability, Cp": "Zone over six standard deviations of what the process makes; 1 leaves 0.27 % outside.",
    "Cpk": "Distance of the mean from the nearer limit over three standard deviations.",
    "certificate": "Lower bound on the cost of drawings that keep the limits: of all drawings where every limited "
    "value is linear in the deviations, of drawings near by otherwise; errors of units counted, no solver trusted.",
    "confidence": "Share of repeated studies in which such a statement is true.",
    "first-order index": "Share of the variance that one error makes alone (Sobol's S1).",
    "fresh units": "Random units that no search has used, on which the drawing is judged.",
    "lift": "How much larger the deviations are among the units beyond a limit than among all units.",
    "lost motion": "How far the output turns while the torque goes from +3 % to −3 % of the rated torque.",
    "NSGA-II": "A genetic search for designs that are each the cheapest for some limit.",
    "order": "Number of waves per turn of the output.",
    "peak-to-peak": "Largest minus smallest transmission error over one turn of the output.",
    "preloaded": "Said of a reducer whose pins press harder without torque than the rated torque presses them: it "
    "turns, but warm, worn early and without lost motion.",
    "quantile": "Value that a stated share of the units keeps.",
    "kept value per zone": "Change of what is compared with the limit per micrometre of the zone.",
    "Sens": "Change of the output per micrometre of deviation: with its sign for a single dimension, root mean square "
    "for a position or a wave, whose direction is random.",
    "surrogate": "Fast stand-in for the model, used only with its error stated.",
    "total index": "Share of the variance in which an error has a part, alone or with others (Sobol's ST).",
    "transmission error": "Angle by which the output is ahead of or behind the ideal ratio.",
    "yield": "Share of the units that keep a limit.",
    "zone": "Full width of what the drawing allows: both sides of ±, a diameter of position, a reading of run-out.",
}
"""Word → what it means, for readers of drawings; `docs/reference/nomenclature.md` has the names in the code."""

_OTHER = {"capability, Cp": ("Cp ", "capability"), "Sens": ("Sens ",), "surrogate": ("surrogate", "stand-in")}
"""How a word is written in reports where that differs from its entry."""


def words_in(texts: Iterable[str]) -> list[tuple[str, str]]:
    """Return the words of the glossary that stand in some texts, in alphabetical order.

    >>> [word for word, _ in words_in(["The yield at 60″."])]
    ['yield']
    """
    text = " ".join(texts)
    lower = text.lower()
    return [
        (word, meaning)
        for word, meaning in GLOSSARY.items()
        if any(own in text if own[0].isupper() else own in lower for own in _OTHER.get(word, (word,)))
    ]
