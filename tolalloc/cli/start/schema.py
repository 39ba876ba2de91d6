"""JSON schemas of the TOML files that users write, made from the records that read them, so that neither can drift.

An editor that knows them (`#:schema` in the first line of a file) offers the fields and marks what is not allowed. What
several fields must keep together, such as K1 below 1, is said by the program alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydantic import BaseModel, create_model

from tolalloc.assembly.files import ChainRecord, PartRecord
from tolalloc.assembly.steps import AssemblyStep
from tolalloc.bench.measurement.files import CurveRecord, LoopRecord, MeasurementRecord, PeakToPeakRecord
from tolalloc.exceptions import UnknownNameError
from tolalloc.reducers.reducer.files import ReducerRecord
from tolalloc.reducers.reducer.stiffness_records import IdentifiedStiffnessRecord
from tolalloc.reducers.reducer.unit_file import UnitRecord


def _chain() -> type[BaseModel]:
    """Return the record of a chain file with its inner tables, which are read one by one."""
    inner: dict[str, Any] = {"part": (tuple[PartRecord, ...], ...), "step": (tuple[AssemblyStep, ...], ())}
    return create_model("ChainRecord", __base__=ChainRecord, **inner)


def _bench() -> type[BaseModel]:
    """Return the record of a measurement file with its inner tables, which are read one by one."""
    inner: dict[str, Any] = {
        "units": (str | tuple[str, ...], ...),  # one name is read as a list of one
        "peak_to_peak": (PeakToPeakRecord | None, None),
        "curves": (tuple[CurveRecord, ...], ()),
        "loops": (tuple[LoopRecord, ...], ()),
    }
    return create_model("MeasurementRecord", __base__=MeasurementRecord, **inner)


KINDS: dict[str, Callable[[], type[BaseModel]]] = {
    "reducer": lambda: ReducerRecord,
    "unit": lambda: UnitRecord,
    "stiffness": lambda: IdentifiedStiffnessRecord,
    "bench": _bench,
    "chain": _chain,
}
"""Kind of TOML file → the record that reads it."""


def schema(kind: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of TOML file.

    Raises
    ------
    UnknownNameError
        There is no such kind.

    Examples
    --------
    >>> schema("reducer")["properties"]["crank_count"]["maximum"]
    6
    """
    if kind not in KINDS:
        raise UnknownNameError.among("schema", "kind", kind, KINDS)
    record = KINDS[kind]()
    found = record.model_json_schema(by_alias=True)
    for table in (found, *found.get("$defs", {}).values()):
        for own in table.get("properties", {}).values():
            own.pop("title", None)  # pydantic's, the name once more
        if spacing := table.get("properties", {}).get("disc_spacing_mm"):
            del spacing["default"]
            spacing["description"] = "the face width, unless given"
    title = f"{kind} file of tolalloc"
    return {**found, "$schema": "https://json-schema.org/draft/2020-12/schema", "title": title}
