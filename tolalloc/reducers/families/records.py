"""What the files of all families may hold, by which a file tells its family."""

from __future__ import annotations

from functools import cache

from tolalloc.reading.plugins import plugins
from tolalloc.reducers.families.centre_gear.design import CentreGearRecord
from tolalloc.reducers.families.single_stage.design import SingleStageRecord
from tolalloc.reducers.reducer.records import AnyReducerRecord, ReducerRecord

SHIPPED: tuple[type[AnyReducerRecord], ...] = (ReducerRecord, CentreGearRecord, SingleStageRecord)
FAMILY = ("name", "record", "interfaces", "new")  # Attributes by which a family is known


@cache
def records() -> tuple[type[AnyReducerRecord], ...]:
    """Return the record of each family; a file is of the last one whose table is in it."""
    shipped = [own.design.family for own in SHIPPED]
    return (*SHIPPED, *(own.record for own in plugins("families", shipped, FAMILY, "name").values()))
