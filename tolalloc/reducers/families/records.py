"""What the files of all families may hold, by which a file tells its family."""

from __future__ import annotations

from functools import cache
from typing import Any

from tolalloc.reading.plugins import plugins
from tolalloc.reducers.families.centre_gear.design import CentreGearRecord
from tolalloc.reducers.families.single_stage.design import SingleStageRecord
from tolalloc.reducers.reducer.records import AnyReducerRecord, ReducerRecord

SHIPPED: tuple[type[AnyReducerRecord], ...] = (ReducerRecord, CentreGearRecord, SingleStageRecord)
FAMILY = ("name", "record", "interfaces", "new")  # Attributes by which a family is known


def brought() -> dict[str, Any]:
    """Return the families of other packages by name, each with a table in its files that no other has."""
    tables = {own.table for own in SHIPPED}

    def require(family: Any) -> None:
        if family.record.design.family != family.name:
            raise ValueError(f"its record is of the family {family.record.design.family!r}, not of {family.name!r}")
        if family.record.table in tables:
            raise ValueError(f"the table {family.record.table!r} of its files belongs to another family")
        tables.add(family.record.table)

    return plugins("families", [own.design.family for own in SHIPPED], FAMILY, "name", require)


@cache
def records() -> tuple[type[AnyReducerRecord], ...]:
    """Return the record of each family; a file is of the last one whose table is in it."""
    return (*SHIPPED, *(own.record for own in brought().values()))
