"""Units: factors to the SI units used inside, and the units in the names of outputs and columns.

Multiply by the factor on the way in, divide on the way out: ``length = 4.0 * MICROMETRE``.
"""

from __future__ import annotations

import re
from math import pi

MILLIMETRE = 1e-3
MICROMETRE = 1e-6
INCH = 25.4e-3
MICRORADIAN = 1e-6
DEGREE = pi / 180.0
ARCMINUTE = DEGREE / 60.0
ARCSECOND = DEGREE / 3600.0
RPM = 2 * pi / 60.0
MEGAPASCAL = 1e6
GIGAPASCAL = 1e9

COST_UNITS = "cost units"
"""What costs are counted in where no file states a currency."""
_CURRENCY = re.compile(r"([A-Z]{3}|[€$£¥])(?=[ /·×]|$)")


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
