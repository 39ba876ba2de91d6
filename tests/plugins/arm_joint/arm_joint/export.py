"""A file of its own in the folder of an allocation."""

from pathlib import Path

from tolalloc.allocation.result import AllocationResult
from tolalloc.reports.header import Header


def write_zones(result: AllocationResult, header: Header, folder: Path) -> None:
    """Write the zones alone, one to a line [µm]."""
    lines = (f"{own.name} {own.zone * 1e6:.2f}\n" for own in result.drawn_sources)
    (folder / f"{header.name}.zones").write_text("".join(lines), encoding="utf-8")
