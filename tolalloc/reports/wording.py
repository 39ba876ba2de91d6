"""How the name of an output, which carries its unit, is said in sentences and headers."""

from __future__ import annotations

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
