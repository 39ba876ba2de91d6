"""Forces in every interface at the equilibria: pins, bearings, meshes and supports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.rv.equivalent.answers import Equilibria
from tolalloc.rv.equivalent.solvers.forces import Forced, solve_forces
from tolalloc.rv.equivalent.solvers.turn import design_of

SINGLE = ("gear_mesh",)
"""Interfaces that carry along one direction; the others carry x and y."""


@dataclass(frozen=True, kw_only=True)
class Forces:
    """Forces on the downstream part, positive where the interface is compressed; NaN where nothing converged.

    Parameters
    ----------
    pins
        Normal force between every pin and every disc [N].
    rows
        Force of every bilateral spring [N].
    elements
        Force x, y of every element with play; a mesh has x only [N].
    rows_of_stiffness
        As in `tolalloc.rv.equivalent.columns.Columns` [-].
    """

    pins: Float[np.ndarray, "sample angle disc pin"]
    rows: Float[np.ndarray, "sample angle row"]
    elements: Float[np.ndarray, "sample angle element 2"]
    rows_of_stiffness: dict[str, slice]

    def of(self, interface: str) -> Float[np.ndarray, "sample angle element"]:
        """Return the magnitude of the force in each element of an interface, named as in `Stiffness` [N]."""
        own, bilateral = self.rows_of_stiffness[interface], self.rows.shape[2]
        if own.start >= bilateral:
            played = self.elements[:, :, own.start - bilateral : own.stop - bilateral]
            return np.asarray(np.hypot(played[..., 0], played[..., 1]))
        rows = self.rows[:, :, own]
        if interface in SINGLE:
            return np.asarray(np.abs(rows))
        return np.asarray(np.hypot(rows[:, :, 0::2], rows[:, :, 1::2]))


def forces(equilibria: Equilibria) -> Forces:
    """Return the forces in all interfaces.

    Notes
    -----
    Stiffness times compression of every row, theory page equation (5); pins by their law, equations (30) and (31),
    elements with play by equation (28).
    """
    tables, columns = equilibria.tables, equilibria.columns
    shape = equilibria.status.shape
    pins = np.empty((*shape, tables.contact_by_disc.shape[1], tables.contact_by_disc.shape[3]))
    rows = np.empty((*shape, tables.row_stiffness.shape[1]))
    elements = np.empty((*shape, tables.play_stiffness.shape[1], 2))
    solve_forces(
        tables,
        columns.layout,
        columns.map,
        design_of(equilibria.reducer),
        np.ascontiguousarray(equilibria.errors),
        equilibria.torque,
        equilibria.status,
        equilibria.kept,
        Forced(pins, rows, elements),
    )
    return Forces(pins=pins, rows=rows, elements=elements, rows_of_stiffness=columns.rows_of_stiffness)
