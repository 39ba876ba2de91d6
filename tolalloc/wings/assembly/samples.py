"""Assemblies of a new reducer, invented or simulated: a chain with measured angles, and the parts of two units."""

from __future__ import annotations

import re

from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.families.known import SOURCES
from tolalloc.study.sample import NewReducer, Sample
from tolalloc.wings.assembly.files import DATA
from tolalloc.wings.assembly.places import own_name, places_of

_UNITS = 2
_MEASURED = """# Invented: errors of the axes of one assembly's parts, each about its own x, y, z.
part,x [arcsec],y [arcsec],z [arcsec]
KC1,12,-8,5
KC2,-6,14,-9
KC3,4,10,-13
KC4,-11,-3,7
"""
_NO_REDUCER = (
    '# reducer = "reducer.toml" tells what the angles do to the transmission, '
    'where its pin_contact_law is "constant" or "table2"'
)


def assembly_files(new: NewReducer) -> dict[str, str]:
    """Return a chain file of two cranks and two discs, and measured angles of its parts, by file name.

    The chain names no reducer: a line contact, which a new reducer has, does not say what a leaning disc does.
    """
    text = (DATA / "bx40e.chain.toml").read_text(encoding="utf-8")
    text = re.sub(r'^reducer = ".*"$', _NO_REDUCER, text, count=1, flags=re.MULTILINE)
    text = re.sub(r'^name = "BX40E"$', f'name = "{new.reducer.name}"', text, count=1, flags=re.MULTILINE)
    return {"chain.toml": text, "angles.csv": _MEASURED}


def parts_files(new: NewReducer) -> dict[str, str]:
    """Return measured parts of two units, for ``tolalloc mount``."""
    rows = ["# Simulated: the parts of two units, drawn inside the tolerance table.", "part,kind,error,value,unit"]
    places = places_of(new.reducer)
    for unit, x in enumerate(new.units(_UNITS), start=1):
        for name, value in zip(new.errors.columns, x, strict=True):
            if SOURCES.of_column(name).first_stage:
                continue
            for place in places:
                if error := own_name(name, place):
                    rows.append(f"{place.name}-{unit},{place.kind},{error},{value / MICROMETRE:.2f},µm")
    return {"parts.csv": "\n".join(rows) + "\n"}


SAMPLES = {
    "parts": Sample(
        files={"parts.csv": "measured parts of two units, simulated"},
        make=parts_files,
        command="tolalloc mount parts.csv --reducer reducer.toml",
        needs_cranks=True,
    ),
    "assembly": Sample(
        files={
            "chain.toml": "which part is adjusted against which, as zhang2025 has it",
            "angles.csv": "measured angles of four parts, invented",
        },
        make=assembly_files,
        command="tolalloc assemble chain.toml --measured angles.csv",
        needs_cranks=True,
    ),
}
