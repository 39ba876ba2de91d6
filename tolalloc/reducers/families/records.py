"""What the files of all families may hold, by which a file tells its family."""

from __future__ import annotations

from tolalloc.reducers.families.centre_gear.design import CentreGearRecord
from tolalloc.reducers.families.single_stage.design import SingleStageRecord
from tolalloc.reducers.reducer.records import AnyReducerRecord, ReducerRecord

RECORDS: tuple[type[AnyReducerRecord], ...] = (ReducerRecord, CentreGearRecord, SingleStageRecord)
"""Record of each family; a file is of the last one whose table is in it."""
