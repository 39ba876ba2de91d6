"""Units: factors to the SI units used inside (multiply on the way in, divide on the way out), and units in names."""

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
WRITTEN_UNITS = ("mm", "µm", "um", "in", "inch", "%", "cm", "m", "nm")
"""Units that a cell may state behind its number."""
_NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
WITH_UNIT = re.compile(rf"((?:±\s*|\+/-\s*|\+-\s*)?{_NUMBER})\s*({'|'.join(WRITTEN_UNITS)}|″|\")", re.ASCII)
"""Number, or one behind ±, with a unit behind it."""
_LITERAL = re.compile(r'"\s*([^"]*?)\s*"|\\ ?([^\W\d_]+)')
"""Words in the format of a number."""
_THOUSANDTH = re.compile(r"[0#?],+(?![0#?])")
"""Format of a number that shows it in thousands."""


def unit_of(name: str) -> str:
    """Return the unit in the name of an output, which stands last in brackets."""
    return name.split("[")[-1].split("]")[0] if "[" in name else "-"


def currency_in(unit: str) -> str:
    """Return the currency that a unit of costs begins with, three letters or a sign; empty where there is none."""
    found = _CURRENCY.match(unit)
    return found[1] if found else ""


def in_cost_units(unit: str) -> str:
    """Return a unit with cost units for its currency, so that it is known whatever a user counts costs in."""
    return _CURRENCY.sub(COST_UNITS, unit, count=1)


def usual_signs(unit: str) -> str:
    """Return a unit with the one µ and the one dot that are meant; others are typed too, and look alike."""
    return unit.replace("\u03bc", "µ").replace("\u22c5", "·")


def is_unit(text: str) -> bool:
    """Return whether a text is the unit of a column of a tolerance table."""
    text = text.strip()
    return (
        usual_signs(text) in (*WRITTEN_UNITS, "-", "unit", "half zone", COST_UNITS) or currency_in(text) == text != ""
    )


def number_in(cell: str, unit: str) -> str:
    """Return what a cell states without the unit behind its number.

    Raises
    ------
    ValueError
        It states another unit.
    """
    found = WITH_UNIT.fullmatch(usual_signs(cell))
    if found is None:
        return cell
    stated = {"um": "µm", "inch": "in", "″": "in", '"': "in"}.get(found[2], found[2])
    if stated != unit:
        raise ValueError(f"a number in {unit}, as the row says; numbers are not converted")
    return found[1]


def shown_number(value: float, form: str) -> str:
    """Return a number with what its format adds to it: leading zeros, per cent, the name of a unit."""
    if re.fullmatch(r"0{2,}", form) and float(value).is_integer():
        return f"{int(value):0{len(form)}d}"
    if "%" in re.sub(r'"[^"]*"', "", form):
        return f"{100 * value:.12g}%"
    named = (usual_signs(quoted or bare) for quoted, bare in _LITERAL.findall(form.split(";")[0]))
    unit = next((name for name in named if name in WRITTEN_UNITS), "")
    if _THOUSANDTH.search(form):
        return f"{value:g} shown in thousands"
    number = str(int(value) if float(value).is_integer() else value)
    return f"{number} {unit}" if unit else number
