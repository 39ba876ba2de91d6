"""How the name of an output, which carries its unit, is said in sentences and headers."""

from __future__ import annotations

import re

COST_UNITS = "cost units"
"""What costs are counted in where no file states a currency."""
_CURRENCY = re.compile(r"([A-Z]{3}|[€$£¥])(?=[ /·×]|$)")

QUICK_RUN = "Quick run: small samples, wide intervals. Run without --quick before setting a drawing."
"""What every answer of a quick run warns of."""

_SIGNS = {"arcsec": "″", "%": " %"}
_UNDERSTOOD = " transmission error"
"""What an engineer leaves out where nothing else is meant."""


def unit_of(name: str) -> str:
    """Return the unit in the name of an output, which stands last in brackets.

    >>> unit_of("lost motion [arcmin]")
    'arcmin'
    """
    return name.split("[")[-1].split("]")[0] if "[" in name else "-"


def currency_in(unit: str) -> str:
    """Return the currency that a unit of costs begins with, three letters or a sign; empty where there is none.

    >>> currency_in("EUR µm^n"), currency_in("€"), currency_in("cost units")
    ('EUR', '€', '')
    """
    found = _CURRENCY.match(unit)
    return found[1] if found else ""


def in_cost_units(unit: str) -> str:
    """Return a unit with cost units for its currency, so that it is known whatever a user counts costs in.

    >>> in_cost_units("EUR µm^n"), in_cost_units("µm")
    ('cost units µm^n', 'µm')
    """
    return _CURRENCY.sub(COST_UNITS, unit, count=1)


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
