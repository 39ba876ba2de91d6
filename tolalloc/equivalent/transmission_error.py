"""The equivalent model of a reducer: errors in, transmission error out."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from math import pi

import numpy as np
from jaxtyping import Float, Int, UInt8

from tolalloc.equivalent.adjoint import solve_derivatives
from tolalloc.equivalent.condensation import ColumnLists, CondensedAngles, column_lists, condense
from tolalloc.equivalent.contact_solver import CONVERGED, solve_curves
from tolalloc.equivalent.extremes import solve_extremes
from tolalloc.reducer.design import Reducer

_MARGIN = 2
"""Nodes before and behind the turn that the cubic interpolation needs."""


@dataclass(frozen=True, kw_only=True)
class AngleSearch:
    """At which carrier angles the extremes are looked for.

    Parameters
    ----------
    coarse
        Equally spaced angles of the turn at which every sample is solved [-].
    nodes_per_coarse
        Tabulated angles per coarse one; between them the tables are interpolated [-].
    levels
        Halvings of the coarse step around a candidate [-].
    safety
        A candidate is followed while this many times its flank's rise could make it the extreme [-].

    Notes
    -----
    With the defaults the peak-to-peak of 99 % of random RV-20E units lies within 0.05″ of the finest search;
    `tests/verification/test_extremes.py` measures it.
    """

    coarse: int = 936
    nodes_per_coarse: int = 4
    levels: int = 10
    safety: float = 1.5


@dataclass(frozen=True, kw_only=True)
class Curves:
    """Transmission error over one output turn.

    Parameters
    ----------
    carrier_angle
        θc [rad].
    transmission_error
        Carrier rotation beyond θc, output side [rad].
    status
        Values of `tolalloc.equivalent.status.Status` [-].
    residual
        Largest component of the unbalanced force over the largest force [-].
    pins_in_contact
        Number of pins that carry load, all discs [-].
    """

    carrier_angle: Float[np.ndarray, " angle"]
    transmission_error: Float[np.ndarray, "sample angle"]
    status: UInt8[np.ndarray, "sample angle"]
    residual: Float[np.ndarray, "sample angle"]
    pins_in_contact: UInt8[np.ndarray, "sample angle"]


@dataclass(frozen=True, kw_only=True)
class Extremes:
    """Largest and smallest transmission error of each sample over one output turn.

    Parameters
    ----------
    largest, smallest
        Extremes of the transmission error, output side [rad].
    carrier_angle
        Where they occur [rad].
    remaining
        What still finer angles may add to the peak-to-peak, an estimate [rad].
    solves
        Equilibria solved [-].
    status
        Worst status of the sample's angles [-].
    residual
        Largest residual over the largest force of the sample's angles [-].
    """

    largest: Float[np.ndarray, " sample"]
    smallest: Float[np.ndarray, " sample"]
    carrier_angle: Float[np.ndarray, "sample 2"]
    remaining: Float[np.ndarray, " sample"]
    solves: Int[np.ndarray, " sample"]
    status: UInt8[np.ndarray, " sample"]
    residual: Float[np.ndarray, " sample"]

    @property
    def peak_to_peak(self) -> Float[np.ndarray, " sample"]:
        """Peak-to-peak transmission error [rad]."""
        return np.asarray(self.largest - self.smallest)


@dataclass(frozen=True)
class EquivalentModel:
    """Equivalent spring model of one reducer, liu2020 equations (1)–(14).

    Parameters
    ----------
    reducer
        Nominal design, stiffness and load.
    search
        At which angles the extremes are looked for.

    Notes
    -----
    The tables of a model take about 23 kB per node for an RV-20E and are made when first needed.
    """

    reducer: Reducer
    search: AngleSearch = field(default_factory=AngleSearch)

    @cached_property
    def _lists(self) -> ColumnLists:
        return column_lists(self.reducer)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the error columns, the order of the errors that every method takes."""
        return self._lists.names

    @cached_property
    def _tables(self) -> tuple[Float[np.ndarray, "..."], ...]:
        nodes = self.search.coarse * self.search.nodes_per_coarse
        return self._condensed(2 * pi * np.arange(-_MARGIN, nodes + _MARGIN + 1) / nodes)

    def _condensed(self, angle: Float[np.ndarray, " angle"]) -> tuple[Float[np.ndarray, "..."], ...]:
        tables = condense(self.reducer, self._lists, angle)
        return tuple(np.ascontiguousarray(getattr(tables, item.name)) for item in fields(CondensedAngles))

    def curves(
        self,
        errors: Float[np.ndarray, "sample column"],
        torque: float,
        carrier_angle: Float[np.ndarray, " angle"] | None = None,
    ) -> Curves:
        """Return the transmission error of every sample at the carrier angles.

        Parameters
        ----------
        errors
            Deviations in the order of ``columns`` [m].
        torque
            Torque on the carrier; negative resists the rotation [N·m].
        carrier_angle
            Carrier angles; the coarse angles of the search unless given [rad].
        """
        if carrier_angle is None:
            carrier_angle = 2 * pi * np.arange(self.search.coarse) / self.search.coarse
        tables = self._condensed(carrier_angle)
        shape = (errors.shape[0], carrier_angle.size)
        rotation, residual = np.empty(shape), np.empty(shape)
        status, touching = np.empty(shape, np.uint8), np.empty(shape, np.uint8)
        discs_at = np.empty((*shape, 3 * self.reducer.disc_count))
        lists = (self._lists.bilateral, self._lists.contact)
        solve_curves(
            tables, lists, np.ascontiguousarray(errors), torque, 0, 1, rotation, discs_at, status, residual, touching
        )
        rotation[status != CONVERGED] = np.nan  # an unconverged angle is a status, never a number
        return Curves(
            carrier_angle=carrier_angle,
            transmission_error=rotation,
            status=status,
            residual=residual,
            pins_in_contact=touching,
        )

    def extremes(self, errors: Float[np.ndarray, "sample column"], torque: float) -> Extremes:
        """Return the refined extremes of every sample over one output turn.

        Parameters
        ----------
        errors
            Deviations in the order of ``columns`` [m].
        torque
            Torque on the carrier; negative resists the rotation [N·m].
        """
        samples, search = errors.shape[0], self.search
        extreme, position = np.empty((samples, 2)), np.empty((samples, 2))
        left_over, residual = np.empty(samples), np.empty(samples)
        solves, status = np.empty(samples, np.int64), np.empty(samples, np.uint8)
        lists = (self._lists.bilateral, self._lists.contact)
        how = (_MARGIN, search.nodes_per_coarse, search.levels, search.safety)
        solve_extremes(
            self._tables, lists, np.ascontiguousarray(errors), torque, search.coarse, how,
            extreme, position, left_over, solves, status, residual,
        )  # fmt: skip
        extreme[status != CONVERGED] = np.nan
        return Extremes(
            largest=extreme[:, 0],
            smallest=extreme[:, 1],
            carrier_angle=(position - _MARGIN) * (2 * pi / (search.coarse * search.nodes_per_coarse)),
            remaining=left_over,
            solves=solves,
            status=status,
            residual=residual,
        )

    def peak_to_peak_derivatives(
        self, errors: Float[np.ndarray, "sample column"], torque: float
    ) -> tuple[Extremes, Float[np.ndarray, "sample column"]]:
        """Return the extremes and the exact derivative of the peak-to-peak by every column [rad/m].

        Parameters
        ----------
        errors
            Deviations in the order of ``columns`` [m].
        torque
            Torque on the carrier; negative resists the rotation [N·m].

        Notes
        -----
        Theory page, equation (23). It holds while both extremes stay at the same kinks of the curve: the derivative
        is one-sided where another angle becomes the extreme, or another pin takes over, at just these errors.
        """
        extremes = self.extremes(errors, torque)
        per_turn = self.search.coarse * self.search.nodes_per_coarse / (2 * pi)
        derivative = np.empty(errors.shape)
        solve_derivatives(
            self._tables,
            (self._lists.bilateral, self._lists.contact),
            np.ascontiguousarray(errors),
            torque,
            extremes.carrier_angle * per_turn + _MARGIN,
            self.search.nodes_per_coarse * 0.5**self.search.levels,
            derivative,
            extremes.status,
        )
        return extremes, derivative
