"""Sample assembly: the shipped chain on the new reducer, and angles that a measuring machine might have read."""

from __future__ import annotations

import re

from tolalloc.assembly.files import DATA
from tolalloc.reducers.reducer.design import Reducer

_ANGLES = """# Invented: errors of the axes of one assembly's parts, each about its own x, y, z.
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


def assembly_files(reducer: Reducer) -> dict[str, str]:
    """Return a chain file of two cranks and two discs, and measured angles of its parts, by file name.

    The chain names no reducer: a line contact, which a new reducer has, does not say what a leaning disc does.
    """
    text = (DATA / "bx40e.chain.toml").read_text(encoding="utf-8")
    text = re.sub(r'^reducer = ".*"$', _NO_REDUCER, text, count=1, flags=re.MULTILINE)
    text = re.sub(r'^name = "BX40E"$', f'name = "{reducer.name}"', text, count=1, flags=re.MULTILINE)
    return {"chain.toml": text, "angles.csv": _ANGLES}
