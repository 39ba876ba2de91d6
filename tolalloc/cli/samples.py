"""Samples of what commands of the trunk read, simulated with a new reducer or invented, and said to be so."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase

from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.table_file import DATA
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.unit_file import table_text
from tolalloc.study.sample import NewReducer, Sample
from tolalloc.wings import wings

_WAYS = (("jig bored", "bored", "jig ground"), ("ground", "turned", "ground twice"), ("ground", "turned", "lapped"))
"""Of each pattern of sources that is priced, the processes of today, for wide zones alone, and for narrow ones."""
_HEADER = (
    "# Invented ways to make the features: replace them by your own. A row without a factor is today's process, with\n"
    "# the cost of the tolerance table at its zone. min and max are cut to those of the table.\n"
    "sources,process,model,fixed [cost units],factor [cost units µm^n],min [µm],max [µm],change [cost units],"
    "inspection [cost units],note"
)
_SHOP = """# Invented prices, for trying: replace them by what your shop quotes.
process,tolerance,unit,cost
pin turned,40,µm,4
pin turned,20,µm,5.5
pin turned,10,µm,9
pin turned,6,µm,13.5
pin ground,10,µm,11
pin ground,6,µm,12.5
pin ground,3,µm,18
pin ground,2,µm,25
"""
_CYCLE = (("start", 1.2, 10, 10), ("constant", 0.6, 20, 30), ("stop", -0.8, 10, 10), ("hold", 0.3, 1, 50))
"""Load cases of a joint: name, torque over the rated one that resists [-], speed [rpm], share of the time [%]."""
_CYCLE_HEADS = ("case", "torque [N·m]", "speed [rpm]", "share [%]")
_PARTS = 60


def _processes(new: NewReducer) -> dict[str, str]:
    """Return a process capability library and a process cost table that prices patterns of sources."""
    rows = [_HEADER]
    for pattern, (today, wide, narrow) in zip(family_of(new.reducer).new.priced, _WAYS, strict=True):
        like = [own for own in new.sources if fnmatchcase(own.name, pattern)]
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


def _pins(new: NewReducer) -> dict[str, str]:
    """Return diameters of made pins, for the column ``measured`` of the tolerance table."""
    source = next(own for own in new.sources if own.name == "pin.diameter")
    drawn = SeedTree(1).child("pins").generator().normal(0.1, 0.8, _PARTS) * source.zone / 6 / MICROMETRE
    return {"pin_diameters.csv": "deviation [µm]\n" + "".join(f"{value:.2f}\n" for value in drawn)}


def _cycle(new: NewReducer) -> dict[str, str]:
    """Return load cases of a robot's joint, for ``tolalloc duty``."""
    rated = new.reducer.load.rated_torque
    rows = [(name, float(f"{-share * rated:.4g}"), *rest) for name, share, *rest in _CYCLE]
    return {"cycle.csv": table_text(_CYCLE_HEADS, rows, ("Invented, for trying: replace it by your own.",))}


_OWN = {
    "costs": Sample(
        files={"shop.csv": "prices of a shop, invented"},
        make=lambda _: {"shop.csv": _SHOP},
        command="tolalloc costs shop.csv",
    ),
    "processes": Sample(
        files={
            "processes.csv": "what processes hold, assumed",
            "process_costs.csv": "ways to make a feature and what each costs, invented",
            "with_processes.py": "the study with these ways to choose from",
        },
        make=_processes,
        command="tolalloc check with_processes.py",
    ),
    "cmm": Sample(
        files={
            "pin_diameters.csv": "measured pins, simulated: name it under `measured`, with `empirical` under "
            "`distribution`"
        },
        make=_pins,
    ),
    "cycle": Sample(
        files={"cycle.csv": "load cases of a joint, invented"},
        make=_cycle,
        command="tolalloc duty cycle.csv --reducer reducer.toml",
    ),
}


def samples() -> Mapping[str, Sample]:
    """Return all kinds of samples by their names, those of the wings behind the trunk's."""
    return _OWN | {kind: own for wing in wings() for kind, own in wing.samples().items()}
