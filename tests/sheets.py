"""Reading a sheet for a drawing program back, by nothing but its lines and texts."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from ezdxf import readfile


def cells(path: Path, layer: str) -> list[list[str]]:
    """Return what stands in the boxes of a layer, row by row from the top, cells from the left, lines of a cell joined.

    A box is a closed polyline of four points; one that holds another one is none.
    """
    space = readfile(path).modelspace()
    found = [[(x, y) for x, y, *_ in own.get_points()] for own in space.query(f'LWPOLYLINE[layer=="{layer}"]')]
    boxes = [points for points in found if len(points) == 4]
    edges = [(min(x for x, _ in own), max(y for _, y in own), own) for own in boxes]
    texts = [(own.dxf.insert.x, own.dxf.insert.y, own.dxf.text) for own in space.query(f'TEXT[layer=="{layer}"]')]
    rows = defaultdict(list)
    for left, top, points in edges:
        right, bottom = max(x for x, _ in points), min(y for _, y in points)
        if any(left < x < right and bottom < y < top for x, y, other in edges if other is not points):
            continue
        inside = sorted((-y, text) for x, y, text in texts if left <= x < right and bottom <= y < top)
        rows[-top].append((left, " ".join(text for _, text in inside)))
    return [[text for _, text in sorted(own)] for _, own in sorted(rows.items())]


def frames(path: Path) -> dict[str, str]:
    """Return name of the dimension → texts of its frame, from the left."""
    drawing = readfile(path)
    space = drawing.modelspace()
    texts = [(own.dxf.insert.x, own.dxf.insert.y, own.dxf.text) for own in space.query('TEXT[layer=="TEXT"]')]
    found = {}
    for own in space.query("INSERT"):
        left, bottom = own.dxf.insert.x, own.dxf.insert.y
        written = sorted((text.dxf.insert.x, text.dxf.text) for text in drawing.blocks[own.dxf.name].query("TEXT"))
        top = bottom + 7.0
        above = [other.dxf.insert.y for other in space.query("INSERT") if other.dxf.insert.x == left]
        lower = max((y + 7.0 for y in above if y < bottom), default=bottom - 300.0)
        before = [x for x in {other.dxf.insert.x for other in space.query("INSERT")} if x < left]
        names = [(-y, text) for x, y, text in texts if max(before, default=0.0) < x < left and lower <= y < top]
        found[" ".join(text for _, text in sorted(names))] = " ".join(text for _, text in written)
    return found


def paragraphs(path: Path) -> list[str]:
    """Return the notes of a sheet."""
    return [own.plain_text() for own in readfile(path).modelspace().query('MTEXT[layer=="TEXT"]')]
