"""How the numbers of a row are known: measured, by a standard, from a supplier, estimated or assumed."""

from __future__ import annotations

import re

ASSUMED = "assumed"
STATUSES = ("measured", "standard", "supplier", "estimated", ASSUMED)
CELLS = ("zone", "range", "cost")
"""What of a row has a status: its zone, the smallest and largest one, and its cost."""

_BY_NOTE = re.compile(rf"\b({'|'.join(STATUSES)})\s*:", re.IGNORECASE)
"""A status at the head of a note, or of a part of it, as in ``assumed: as for like bores``."""


def parsed_provenance(text: str) -> dict[str, str]:
    """Return cell → status of what a table states: one word for all three, or some as ``zone:measured cost:assumed``.

    Raises
    ------
    ValueError
        A word that is no status, or a cell that is none or there twice.

    Examples
    --------
    >>> parsed_provenance("zone:measured cost:assumed"), parsed_provenance("supplier")["range"]
    ({'zone': 'measured', 'cost': 'assumed'}, 'supplier')
    """
    found = dict[str, str]()
    for item in text.split():
        cell, colon, word = item.rpartition(":")
        cells = (cell,) if colon else CELLS
        if word not in STATUSES or {*cells} - {*CELLS} or {*cells} & {*found}:
            raise ValueError(
                f"allowed is one of {', '.join(STATUSES)} for all, or some of {', '.join(CELLS)} once each, as in "
                f"'zone:measured cost:assumed'; not {item!r}"
            )
        found |= dict.fromkeys(cells, word)
    return found


def provenance_of(stated: str, note: str) -> dict[str, str]:
    """Return cell → status of a row: what it states, else what its note begins with; nothing where neither says it."""
    by_note = _BY_NOTE.search(note)
    return (dict.fromkeys(CELLS, by_note[1].lower()) if by_note else {}) | parsed_provenance(stated)
