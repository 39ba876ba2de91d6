"""The half turn: a unit and the same unit turned by half a turn have one and the same transmission error.

With two discs, two cranks and an even number of pins, a reducer turned by half a turn is the reducer again, its discs
and its cranks exchanged. No curve tells a unit from this twin, so the discs' errors come in pairs.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from tolalloc.rv.reducer.design import Reducer

_OTHER = {"1": "2", "2": "1"}


def has_half_turn(reducer: Reducer, columns: Sequence[str]) -> bool:
    """Return whether half a turn carries the reducer into itself, and these columns among themselves."""
    even = reducer.disc_count == 2 and reducer.crank_count == 2 and reducer.cycloid_stage.pin_count % 2 == 0
    return even and {exchanged(name) for name in columns} == set(columns)


def exchanged(name: str) -> str:
    """Return the name that a source or column has in the unit turned by half a turn."""
    return re.sub(r"\b(disc|crank|journal|bore)([12])\b", lambda part: part[1] + _OTHER[part[2]], name)


def half_turn(columns: Sequence[str], reducer: Reducer) -> Float[np.ndarray, "column column"]:
    """Return the matrix that takes a unit's columns to those of its twin [-].

    Parameters
    ----------
    columns
        Names of the columns.
    reducer
        The reducer; with these columns it has a half turn.

    Notes
    -----
    Vectors change sign. A wave of order h along the ring of pins lags by hπ. A disc's own angle counts from a tooth,
    and half a turn is half a tooth off: the wave of disc 1 lags by hπ(1 + 1/zc), that of disc 2 by hπ(1 − 1/zc), and
    two half turns are none. Sizes stay as they are.
    """
    where = {name: at for at, name in enumerate(columns)}
    matrix = np.zeros((len(columns), len(columns)))
    for at, name in enumerate(columns):
        to = where[exchanged(name)]
        wave = re.search(r"\.(cos|sin)(\d+)$", name)
        if wave is None:
            matrix[to, at] = -1.0 if name.endswith((".x", ".y")) else 1.0
            continue
        past = {"disc1": 1.0, "disc2": -1.0}.get(name.split(".")[0], 0.0) / reducer.cycloid_stage.disc_teeth
        lag = int(wave[2]) * np.pi * (1.0 + past)
        other = where[exchanged(name[: wave.start()] + (".sin" if wave[1] == "cos" else ".cos") + wave[2])]
        matrix[to, at] = np.cos(lag)
        matrix[other, at] = np.sin(lag) if wave[1] == "cos" else -np.sin(lag)
    return matrix
