"""A design that somebody tries: zones and settings, read from what a page sends."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from tolalloc.drawings.fields import LARGEST_ZONE
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.settings import require_settings
from tolalloc.reading.named_fields import is_number
from tolalloc.reading.units import MICROMETRE
from tolalloc.study.prepared import Prepared

_DECIMALS = 4
"""Decimals of a zone; a table writes one more, so that half a zone is written whole too [-]."""
_SMALLEST = 10.0**-_DECIMALS
"""Smallest zone with these decimals [µm]."""


@dataclass(frozen=True)
class LiveDesign:
    """Zones that differ from the drawing's, the values of the model's settings, and under which conditions it is asked.

    Parameters
    ----------
    zones
        Source and its zone [m], by name.
    settings
        Values of all settings, in the model's order [units of their names].
    operating
        Operating condition and its value, by name, where it differs from the study's [units of their names].
    """

    zones: tuple[tuple[str, float], ...]
    settings: tuple[float, ...]
    operating: tuple[tuple[str, float], ...] = ()

    @classmethod
    def read(cls, sent: Any, prepared: Prepared) -> LiveDesign:
        """Return the design of a record ``{"zones": {source: µm}, "settings": {name: value}}``.

        Operating conditions stand among the settings.

        Raises
        ------
        InputError, UnknownNameError
            What is no such record, a source or setting that the study does not have, a value that is not allowed.
        """
        zones, settings = (_numbers(sent, key) for key in ("zones", "settings"))
        present = {own.name: own.zone for own in prepared.errors.active}
        for name, zone in zones.items():
            if name not in present:
                raise UnknownNameError.among("page", "source", name, present)
            if not _SMALLEST <= zone <= LARGEST_ZONE:
                raise InputError.at("page", name, zone, f"a zone of {_SMALLEST:g} to {LARGEST_ZONE:g} µm")
        # A zone that the drawing has is said by the drawing, so that no bit of it depends on the way to the page.
        told = {
            name: round(zone, _DECIMALS) * MICROMETRE
            for name, zone in zones.items()
            if zone != shown_zone(present[name])
        }
        model = prepared.model
        require_settings("page", (*model.settings, *model.operating_conditions), settings)
        values = tuple(float(settings.get(own.name, own.value)) for own in model.settings)
        operating = tuple(
            (own.name, float(settings[own.name]))
            for own in model.operating_conditions
            if settings.get(own.name, own.value) != own.value
        )
        return cls(zones=tuple(sorted(told.items())), settings=values, operating=operating)


def shown_zone(zone: float) -> float:
    """Return a zone as the page shows it [m → µm]."""
    return float(f"{zone / MICROMETRE:.9g}")


def _numbers(sent: Any, key: str) -> Mapping[str, float]:
    """Return a record of numbers inside a record, empty where there is none."""
    found = sent.get(key, {}) if isinstance(sent, dict) else None
    if not isinstance(found, dict) or not all(is_number(value) for value in found.values()):
        raise InputError.at("page", key, found, "names with their numbers")
    return found


def names_in(sent: Mapping[str, Any], key: str, known: Collection[str]) -> frozenset[str]:
    """Return the names that a request lists, none where it lists none.

    Raises
    ------
    InputError, UnknownNameError
        What is no list, or a name that is not known.
    """
    found = sent.get(key, [])
    if not isinstance(found, list):
        raise InputError.at("page", key, found, "a list of names")
    for name in found:
        if name not in known:
            raise UnknownNameError.among("page", key, str(name), known)
    return frozenset(found)
