"""Sample processes: what shops hold, and ways to make the features of a reducer, with invented costs."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from tolalloc.drawings.sources import Source
from tolalloc.drawings.table_file import DATA
from tolalloc.reading.units import MICROMETRE

_WAYS = (
    ("disc?.bore?.position", "jig bored", "bored", "jig ground"),
    ("crank?.journal?.eccentricity", "ground", "turned", "ground twice"),
    ("pin.diameter", "ground", "turned", "lapped"),
)
"""Pattern of sources, and the processes of today, for wide zones alone, and for narrow ones."""
_HEADER = (
    "# Invented ways to make the features: replace them by your own. A row without a factor is today's process, with\n"
    "# the cost of the tolerance table at its zone. min and max are cut to those of the table.\n"
    "sources,process,model,fixed [cost units],factor [cost units µm^n],min [µm],max [µm],change [cost units],"
    "inspection [cost units],note"
)


def process_files(sources: Sequence[Source]) -> dict[str, str]:
    """Return a process capability library and a process cost table, by file name."""
    rows = [_HEADER]
    for pattern, today, wide, narrow in _WAYS:
        like = [own for own in sources if fnmatchcase(own.name, pattern)]
        zone = max(own.zone for own in like) / MICROMETRE
        product = max(own.cost * own.zone for own in like) / MICROMETRE
        rows += [
            f"{pattern},{today},reciprocal,,,,,0,0,assumed: today's process",
            f"{pattern},{wide},reciprocal,0.2,{0.4 * product:.3g},{1.15 * zone:.3g},,0.2,0,"
            "assumed: a cheaper machine that holds wide zones only",
            f"{pattern},{narrow},reciprocal,0.8,{0.3 * product:.3g},,{0.75 * zone:.3g},0.3,0.05,"
            "assumed: a second operation that pays for narrow zones; every part measured",
        ]
    library = (DATA / "generic.processes.csv").read_text(encoding="utf-8")
    return {"processes.csv": library, "process_costs.csv": "\n".join(rows) + "\n"}
