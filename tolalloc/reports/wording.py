"""How the name of an output, which carries its unit, is said in sentences; and words that not every reader knows."""

from __future__ import annotations

import re
import string
from collections.abc import Iterable
from math import floor, log10
from numbers import Integral, Real
from typing import Any

from tolalloc.reading.units import unit_of

QUICK_RUN = "Quick run: wide intervals; run without --quick before setting a drawing."
"""What every answer of a quick run warns of."""

_SIGNS = {"arcsec": "″", "%": " %", "-": ""}
_UNDERSTOOD = " transmission error"
"""What an engineer leaves out where nothing else is meant."""


_ROUNDING = 1e-12
"""Size below which a number is what rounding left of 0 [any unit of a sentence]."""

_POWERS = 6
"""Power of ten from which a number is said with it [-]."""


def number(value: Any, spec: str = "") -> str:
    """Return a number as a sentence says it: a true minus, a blank before %, and 0 for what rounding left of it.

    >>> number(-0.255, ".1%"), number(-3e-15, ".2g"), number(184006, ","), number(390.2, ".2g")
    ('−25.5 %', '0', '184,006', '390')
    """
    if not isinstance(value, Real):
        return format(value, spec)
    if not isinstance(value, Integral) and abs(float(value)) < _ROUNDING:
        value = 0.0
    mantissa, power, exponent = format(value, spec).partition("e")
    if power and 0 < int(exponent) < _POWERS:
        mantissa, power = format(float(f"{mantissa}e{exponent}"), "+,.0f" if "+" in spec else ",.0f"), ""
    if mantissa.startswith("-") and not any(digit in mantissa for digit in "123456789n"):
        mantissa = mantissa.replace("-", "+" if "+" in spec else "")
    mantissa = mantissa.replace("-", "−").replace("%", " %")
    return f"{mantissa}e{int(exponent)}" if power else mantissa


_HYPHEN = re.compile(r"(?<![^\s…(=±,])-(?=\.?\d)")


def true_minus(text: str) -> str:
    """Return a text of a table with a true minus before numbers; a hyphen inside a name or a date stays.

    >>> true_minus("at least -20 µm"), true_minus("-3…-1"), true_minus("disc-1 of 2026-11-26")
    ('at least −20 µm', '−3…−1', 'disc-1 of 2026-11-26')
    """
    return _HYPHEN.sub("−", text)


def signed(text: str) -> str:
    """Return a written number with a true minus, and without one before 0.

    >>> signed("-0.25"), signed("-1e-05"), signed("-0.00"), signed("-inf")
    ('−0.25', '−1e-05', '0.00', '−inf')
    """
    if not text.startswith("-"):
        return text
    return f"−{text[1:]}" if any(digit in text.partition("e")[0] for digit in "123456789n") else text[1:]


def alike(*values: float, figures: int = 3, most: float = float("inf")) -> tuple[str, ...]:
    """Return a value and the ends of its interval with one rounding, the value's in so many figures.

    >>> alike(17.34, 15.66, 19.0), alike(99.0, 97.0, 101.0, most=100.0)
    (('17.3', '15.7', '19.0'), ('99.0', '97.0', '100.0'))
    """
    size = abs(values[0])
    decimals = max(0, figures - 1 - floor(log10(size))) if size > _ROUNDING else figures - 1
    return tuple(number(min(value, most), f",.{decimals}f") for value in values)


class Spoken(string.Formatter):
    """``str.format`` whose numbers are those of sentences."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Return one gap filled."""
        return number(value, format_spec)


def sign_of(unit: str) -> str:
    """Return what follows a number in a ranking: the unit's sign or, after a blank, the unit.

    >>> sign_of("arcmin"), sign_of("N")
    ('′', ' N')
    """
    return {**_SIGNS, "arcmin": "′", "deg": "°"}.get(unit, f" {unit}")


def quantity(name: str) -> str:
    """Return the name of an output without its unit.

    >>> quantity("lost motion [arcmin]")
    'lost motion'
    """
    return name.split(" [")[0]


def enumerated(texts: Iterable[str]) -> str:
    """Return texts as a sentence counts them up.

    >>> enumerated(["one", "two"]), enumerated(["one", "two", "three"])
    ('one and two', 'one, two and three')
    """
    *others, last = texts
    return f"{', '.join(others)} and {last}" if others else last


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
    unit, text = unit_of(name), text.replace("-", "−")
    return f"{text}{_SIGNS[unit]}" if unit in _SIGNS else f"{text} {unit}".strip()


GLOSSARY = {
    "capability, Cp": "Zone over six standard deviations of what the process makes; 1 leaves 0.27 % outside.",
    "Cpk": "Distance of the mean from the nearer limit over three standard deviations.",
    "certificate": "Lower bound on the cost of drawings that keep the limits: of all drawings if every limited "
    "value is linear in the deviations, otherwise of nearby drawings. It is valid whatever the solver did.",
    "confidence": "Share of repeated studies in which such a statement is true.",
    "first-order index": "Share of the variance that one error makes alone (Sobol's S1).",
    "independent verification sample": "Random units that no search has used, on which the drawing is judged.",
    "lift": "How much larger the deviations are among the units beyond a limit than among all units.",
    "lost motion": "How far the output turns while the torque goes from +3 % to −3 % of the rated torque.",
    "order": "Number of waves per turn of the output.",
    "peak-to-peak": "Largest minus smallest transmission error over one turn of the output.",
    "Ppk": "Distance of the mean from the nearer limit over three standard deviations of all units.",
    "preloaded": "A reducer is preloaded if its pin forces without torque exceed those of the rated torque: it turns, "
    "but runs warm, wears early and has no lost motion.",
    "quantile": "Value that a stated share of the units keeps.",
    "kept value per zone": "Change of the value compared with the limit per micrometre of the zone.",
    "Sens": "Change of the output per micrometre of deviation, mean over the units of the drawing, with its sign; root "
    "mean square for a position or a wave, whose direction is random, and where signs cancel.",
    "simulated": "A simulated unit has errors drawn at random from the tolerance table and is solved by the model.",
    "surrogate": "Fast approximation of the model, used only with its error stated.",
    "total-effect index": "Share of the variance in which an error takes part, alone or with others (Sobol's ST).",
    "transmission error": "Angle by which the output is ahead of or behind the ideal ratio.",
    "yield": "Share of the units that keep a limit.",
    "zone": "Full width of what the drawing allows: both sides of ±, a diameter of position, a reading of run-out.",
}
"""Word → what it means, for readers of drawings; `docs/reference/nomenclature.md` has the names in the code."""

_OTHER = {
    "capability, Cp": ("Cp ", "capability"),
    "Sens": ("Sens ",),
    "total-effect index": ("total-effect index", "total index"),
}
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
