"""The families that are known, and all kinds of error sources that they declare."""

from __future__ import annotations

from tolalloc.reducers.equivalent.sources import ErrorSources
from tolalloc.reducers.families.centre_gear.family import CENTRE_GEAR
from tolalloc.reducers.families.family import ReducerFamily
from tolalloc.reducers.families.records import brought
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.families.single_stage.family import SINGLE_STAGE
from tolalloc.reducers.reducer.design import Reducer

_SHIPPED = {own.name: own for own in (RV, CENTRE_GEAR, SINGLE_STAGE)}
FAMILIES: dict[str, ReducerFamily] = _SHIPPED | brought()
"""Name → family, those that other packages bring last."""

INTERFACES = tuple(dict.fromkeys(interface for own in FAMILIES.values() for interface in own.interfaces))
"""Interfaces of all families."""

SOURCES = ErrorSources(dict.fromkeys(kind for own in FAMILIES.values() for kind in own.sources.kinds))
"""Kinds of sources of all families, to be asked by a name alone: one name is one kind in all of them."""


def family_of(reducer: Reducer) -> ReducerFamily:
    """Return the family of a reducer."""
    return FAMILIES[reducer.family]
