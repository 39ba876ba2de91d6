"""The equivalent model of a reducer: errors in; equilibria over a turn, extremes and derivatives out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property, lru_cache
from math import pi
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Integer, UInt8, UInt16

from tolalloc.reducers.equivalent.columns import Columns, columns_of
from tolalloc.reducers.equivalent.condensation import CondensedAngles, bilateral_groups, condense
from tolalloc.reducers.equivalent.solvers.records import (
    CONVERGED,
    NOT_CONVERGED,
    NOT_FINITE,
    NOT_RESISTED,
    OUT_OF_RANGE,
    AngleSearch,
    Given,
    SolvedDerivatives,
    SolverDesign,
    design_of,
)
from tolalloc.reducers.equivalent.springs import HARMONICS, AtAngles, Positions
from tolalloc.reducers.reducer.design import Reducer, at_torque
from tolalloc.reducers.reducer.form import PartForm

OneUnit = Float[np.ndarray, "1 column"]
"""Deviations of one unit, as `Errors`."""
Torques = float | Float[np.ndarray, " sample"]
"""One torque for all samples, or one for each [N·m]."""
Weights = Float[np.ndarray, "sample disc pin"]
"""Weights of the pin forces of every sample."""
Errors = Float[np.ndarray, "sample column"]
"""Deviations of units in the order of the model's columns [m, angles rad], or what has their shape."""
Curves = Float[np.ndarray, "sample angle"]
"""A number of every unit at every carrier angle."""
_FEW_ANGLES = 256
"""Angles up to which tables are kept: loops have 23, a diagnosis up to 240; 8 MB for an RV-20E [-]."""


class Status(IntEnum):
    """Outcome of an equilibrium; the larger, the worse."""

    CONVERGED = CONVERGED
    NOT_CONVERGED = NOT_CONVERGED
    NOT_RESISTED = NOT_RESISTED
    NOT_FINITE = NOT_FINITE
    OUT_OF_RANGE = OUT_OF_RANGE

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        return {
            Status.CONVERGED: "equilibrium found",
            Status.NOT_CONVERGED: "no equilibrium within the allowed number of Newton steps",
            Status.NOT_RESISTED: "no pin resists the torque in its direction",
            Status.NOT_FINITE: "an error value is not a finite number",
            Status.OUT_OF_RANGE: "an output error beyond a tenth of the pin pitch, too far for small displacements",
        }[self]


OUTCOMES: Mapping[int, str] = {int(item): item.sentence for item in Status}
"""Status → outcome in words."""


def count_statuses(status: Integer[np.ndarray, "..."]) -> Mapping[str, int]:
    """Return how often each outcome occurred, by its sentence; every outcome is listed."""
    return {item.sentence: int(np.count_nonzero(status == item)) for item in Status}


@dataclass(frozen=True, kw_only=True)
class Equilibria:
    """Equilibria of samples at carrier angles: what every output is read from."""

    # The nominal design, its error columns and the values that they move, its condensed tables at the angles
    reducer: Reducer
    columns: Columns
    tables: CondensedAngles
    errors: Float[np.ndarray, "sample column"]  # Deviations in the order of the model's columns [m, angles rad]
    torque: float  # Torque on the carrier [N·m]
    carrier_angle: Float[np.ndarray, " angle"]  # θc [rad]
    transmission_error: Float[np.ndarray, "sample angle"]  # Carrier rotation beyond θc, output side [rad]
    # Coordinates that pins and play touch, the discs' x, y, r_d·θ first [m]
    retained: Float[np.ndarray, "sample angle coordinate"]
    status: UInt8[np.ndarray, "sample angle"]  # Values of `tolalloc.reducers.equivalent.model.Status` [-]
    residual: Float[np.ndarray, "sample angle"]  # Largest component of the unbalanced force over the largest force [-]
    pins_in_contact: UInt16[np.ndarray, "sample angle"]  # Number of pins that carry load, all discs [-]


@dataclass(frozen=True, kw_only=True)
class TurnExtremes:
    """Largest and smallest transmission error of each sample over one output turn."""

    # Extremes of the transmission error, output side [rad]
    largest: Float[np.ndarray, " sample"]
    smallest: Float[np.ndarray, " sample"]
    carrier_angle: Float[np.ndarray, "sample 2"]  # Where they occur [rad]
    remaining: Float[np.ndarray, " sample"]  # What still finer angles may add to the peak-to-peak, an estimate [rad]
    # Equilibria solved; worst status and largest residual over the largest force of the sample's angles [-]
    solves: Int[np.ndarray, " sample"]
    status: UInt8[np.ndarray, " sample"]
    residual: Float[np.ndarray, " sample"]

    @property
    def peak_to_peak(self) -> Float[np.ndarray, " sample"]:
        """Peak-to-peak transmission error [rad]."""
        return np.asarray(self.largest - self.smallest)


@dataclass(frozen=True, kw_only=True)
class Derivatives:
    """Exact derivatives of an output, sample by sample or angle by angle."""

    # By every error column, modification included; by the torque [rad/m, rad/rad; rad/(N·m)]
    by_error: Float[np.ndarray, "item column"]
    by_torque: Float[np.ndarray, " item"]
    # By the relative change of all nominal distances and clearances, and of the form of flanks and pins [rad]
    by_nominal: Float[np.ndarray, " item"]
    by_form: Float[np.ndarray, " item"]
    # By the relative change of each stiffness of `tolalloc.reducers.reducer.stiffness.Stiffness` [rad]
    by_stiffness: dict[str, Float[np.ndarray, " item"]]
    status: UInt8[np.ndarray, " item"]  # Worst status of the equilibria behind them [-]


@dataclass(frozen=True)
class EquivalentModel:
    """Equivalent spring model of one reducer, liu2020 equations (1)–(14).

    The tables of a model take about 30 kB per node for an RV-20E and are made when first needed. The compiled solvers
    are imported where they solve, because many commands only ask for the names of the columns.

    Methods take ``errors`` in the order of `columns` [m, angles rad], the ``torque`` on the carrier, which resists the
    rotation where it is negative [N·m], and carrier angles, the coarse ones of the search unless given [rad].
    """

    reducer: Reducer  # Nominal design, stiffness and load
    search: AngleSearch = field(default_factory=AngleSearch)  # At which angles the extremes are looked for
    # Orders of the harmonic deviations of pitch and run-out, per turn of their part [-]
    orders: tuple[int, ...] = HARMONICS

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel to another process without tables; there, every chunk of work finds the same model again."""
        return cached_model, (self.reducer, self.search, self.orders)

    def at_torque(self, torque: float) -> EquivalentModel:
        """Return the model with the stiffness that the reducer's parts have under a torque on the carrier [N·m]."""
        return replace(self, reducer=at_torque(self.reducer, torque)) if self.reducer.parts else self

    def with_form(self, form: PartForm | None) -> EquivalentModel:
        """Return the model of parts with another form of flanks and pins, of perfect ones if it is none."""
        return self if form == self.reducer.form else replace(self, reducer=replace(self.reducer, form=form))

    @cached_property
    def error_columns(self) -> Columns:
        """The error columns and the values that they move."""
        groups = bilateral_groups(Positions(self.reducer, np.zeros(1), self.orders))
        return columns_of(self.reducer, groups, self.orders)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the error columns, the order of the errors that every method takes."""
        return self.error_columns.names

    @property
    def design(self) -> SolverDesign:
        """The reducer as the solvers take it."""
        return design_of(self.reducer)

    @property
    def _discs(self) -> tuple[int, ...]:
        return (0,) * self.reducer.disc_count

    @cached_property
    def _tables(self) -> CondensedAngles:
        return self.tables_at(self.search.node_angle)

    @cached_property
    def _turn(self) -> tuple[AtAngles, CondensedAngles]:
        """The coarse angles and their tables."""
        angle = 2 * pi * np.arange(self.search.coarse) / self.search.coarse
        return angle, self.tables_at(angle)

    def release(self) -> None:
        """Let go of the tables; they are made again when they are needed."""
        for name in ("_tables", "_turn"):
            vars(self).pop(name, None)

    def _given(self, errors: Errors, torque: Torques) -> Given:
        """Return what every solver takes next to the tables: places of the columns, reducer, errors, torque."""
        columns = self.error_columns
        return columns.layout, columns.map, self.design, np.ascontiguousarray(errors), torque

    def tables_at(self, carrier_angle: AtAngles) -> CondensedAngles:
        """Return the condensed tables at the carrier angles [rad], those of few angles made once."""
        if carrier_angle.size > _FEW_ANGLES:
            return condense(self.reducer, self.orders, carrier_angle)
        return _tables_at_few(self.reducer, self.orders, carrier_angle.tobytes())

    def equilibria(self, errors: Errors, torque: float, carrier_angle: AtAngles | None = None) -> Equilibria:
        """Return the equilibrium of every sample at the carrier angles."""
        if carrier_angle is not None:
            return self.equilibria_of(self.tables_at(carrier_angle), errors, torque, carrier_angle)
        angle, tables = self._turn
        turn_of_crank = self.search.turn_of_crank(self.reducer.cycloid_stage.disc_teeth)
        return self.equilibria_of(tables, errors, torque, angle, turn_of_crank)

    def equilibria_of(
        self, tables: CondensedAngles, errors: Errors, torque: float, angle: AtAngles, turn_of_crank: int = 0
    ) -> Equilibria:
        """Return the equilibrium of every sample at the carrier angles, whose tables are there already.

        A crank turns once in so many of them, if they are equally far apart; what is known of that saves time only.
        """
        from tolalloc.reducers.equivalent.solvers.turn import make_turn, solve_curves

        turn = make_turn(errors.shape[0], angle.size, tables.load.shape[2])
        solve_curves(self._discs, turn_of_crank, tables, self._given(errors, torque), turn)
        self._mark_out_of_range(turn.rotation, turn.status)
        turn.rotation[turn.status != CONVERGED] = np.nan  # an unconverged angle is a status, never a number
        return Equilibria(
            reducer=self.reducer,
            columns=self.error_columns,
            tables=tables,
            errors=errors,
            torque=torque,
            carrier_angle=angle,
            transmission_error=turn.rotation,
            retained=turn.retained,
            status=turn.status,
            residual=turn.residual,
            pins_in_contact=turn.touching,
        )

    def extremes(self, errors: Errors, torque: float) -> TurnExtremes:
        """Return the refined extremes of every sample over one output turn."""
        return self.extremes_and_curve(errors, torque, 0)[0]

    def extremes_within(self, errors: Errors, torque: float, window: tuple[float, float]) -> TurnExtremes:
        """Return the extremes of every sample over part of the output turn, at the tabulated angles within it [rad].

        No finer angles are searched: what they may add, `remaining`, is not known.
        """
        step = self.search.node_step
        angle = np.linspace(*window, max(2, 1 + round((window[1] - window[0]) / step)))
        found = self.equilibria(errors, torque, angle)
        curve, sample = found.transmission_error, np.arange(len(errors))
        status, good = found.status.max(axis=1), np.isfinite(found.transmission_error).all(axis=1)
        where = np.stack([np.where(good, own, 0) for own in (curve.argmax(axis=1), curve.argmin(axis=1))], axis=1)
        extreme = np.where(good[:, np.newaxis], curve[sample[:, np.newaxis], where], np.nan)
        return TurnExtremes(
            largest=extreme[:, 0],
            smallest=extreme[:, 1],
            carrier_angle=angle[where],
            remaining=np.full(len(errors), np.nan),
            solves=np.full(len(errors), angle.size),
            status=status,
            residual=found.residual.max(axis=1),
        )

    def exact_extremes(self, errors: OneUnit, torque: float) -> TurnExtremes:
        """Return the extremes of one unit, solved again at their angles with tables of just these angles.

        The search interpolates its tables; what that changed of either extreme is added to what finer angles may add.
        """
        found = self.extremes(errors, torque)
        exact = self.equilibria(errors, torque, found.carrier_angle[0])
        largest, smallest = exact.transmission_error[:, 0], exact.transmission_error[:, 1]
        changed = np.abs(largest - found.largest) + np.abs(smallest - found.smallest)
        return replace(
            found,
            largest=largest,
            smallest=smallest,
            remaining=found.remaining + changed,
            status=np.maximum(found.status, exact.status.max(axis=1)),
            residual=np.maximum(found.residual, exact.residual.max(axis=1)),
        )

    def extremes_and_curve(
        self, errors: Errors, torque: float, angles: int | None = None
    ) -> tuple[TurnExtremes, Curves]:
        """Return the extremes, and the transmission error at the coarse angles that they were looked for from [rad].

        At the first so many of them, or at all.
        """
        from tolalloc.reducers.equivalent.solvers.extremes import make_extremes, solve_extremes

        search = self.search
        found = make_extremes(errors.shape[0], search.coarse if angles is None else angles)
        solve_extremes(self._discs, self._tables, self._given(errors, torque), search, found)
        self._mark_out_of_range(np.abs(found.extreme).max(axis=1), found.status)
        found.extreme[found.status != CONVERGED] = np.nan
        extremes = TurnExtremes(
            largest=found.extreme[:, 0],
            smallest=found.extreme[:, 1],
            carrier_angle=(found.position - search.first) * search.node_step,
            remaining=found.left_over,
            solves=found.solves,
            status=found.status,
            residual=found.residual,
        )
        return extremes, found.curve

    def peak_to_peak_derivatives(self, errors: Errors, torque: float) -> tuple[TurnExtremes, Derivatives]:
        """Return the extremes and the exact derivatives of the peak-to-peak.

        Theory page, equation (23) [rad, rad/m]. They hold while both extremes stay at the same kinks of the curve: a
        derivative is one-sided where another angle becomes the extreme, or another pin takes over, at just these
        errors.
        """
        from tolalloc.reducers.equivalent.solvers.adjoint import solve_peak_to_peak_derivatives

        extremes, search = self.extremes(errors, torque), self.search
        derivative = self._derivative(errors.shape[0])
        derivative.status[:] = extremes.status
        position, step = extremes.carrier_angle / search.node_step + search.first, 0.5**search.levels
        given = self._given(errors, torque)
        solve_peak_to_peak_derivatives(self._tables, given, position, search.nodes_per_coarse * step, derivative)
        np.maximum(extremes.status, derivative.status, out=extremes.status)
        return extremes, self._derivatives(derivative)

    def rotation_derivatives(
        self, errors: Errors, torque: Torques, carrier_angle: AtAngles
    ) -> tuple[Curves, Derivatives]:
        """Return the transmission error at the carrier angles and its exact derivatives, sample by sample in one row.

        The torque is one for all samples or one for each.

        Theory page, equation (23) [rad, rad/m]. They hold while the same pins touch; where one just touches or leaves,
        a derivative is one-sided.
        """
        shape, at = (errors.shape[0], carrier_angle.size), np.arange(carrier_angle.size)
        none = np.zeros((shape[0], self.reducer.disc_count * self.reducer.cycloid_stage.pin_count))
        derivative = self._value_derivatives(errors, torque, carrier_angle, np.tile(at, shape[0]), 1.0, none)
        self._mark_out_of_range(derivative.rotation, derivative.status)
        derivative.rotation[derivative.status != CONVERGED] = np.nan
        return derivative.rotation.reshape(shape), self._derivatives(derivative)

    def pin_force_derivatives(
        self, errors: Errors, torque: float, carrier_angle: AtAngles, at: Int[np.ndarray, " sample"], weights: Weights
    ) -> Derivatives:
        """Return the exact derivatives of Σ weight·force over the pins, of every sample at one of the carrier angles.

        Theory page, equation (23) [N/m]; they hold while the same pins touch. A sample without an equilibrium there has
        zeros and its status.
        """
        of_pins = weights.reshape(errors.shape[0], -1)
        return self._derivatives(self._value_derivatives(errors, torque, carrier_angle, at, 0.0, of_pins))

    def _value_derivatives(
        self,
        errors: Errors,
        torque: Torques,
        carrier_angle: AtAngles,
        at: Int[np.ndarray, " item"],
        carrier: float,
        of_pins: Float[np.ndarray, "sample contact"],
    ) -> SolvedDerivatives:
        """Return those of carrier·rotation + Σ of_pin·force at some of the carrier angles, as many for each sample."""
        from tolalloc.reducers.equivalent.solvers.adjoint import solve_value_derivatives

        # With neighbours that the interpolation weighs with nothing at a node.
        around = carrier_angle[np.clip(np.arange(-1, carrier_angle.size + 2), 0, carrier_angle.size - 1)]
        derivative, torques = self._derivative(at.size), np.broadcast_to(torque, errors.shape[0])
        given = self._given(errors, np.ascontiguousarray(torques))
        of_pins = np.ascontiguousarray(of_pins)
        solve_value_derivatives(self.tables_at(around), given, 1.0 + at, carrier, of_pins, derivative)
        return derivative

    @property
    def largest_rotation(self) -> float:
        """Output error up to which displacements count as small, a tenth of the pin pitch; an assumption [rad].

        Normals and levers are those of the nominal place; there, the next flank is a tenth of the way to the next pin.
        """
        return 0.1 * 2 * pi / self.reducer.cycloid_stage.pin_count

    def _mark_out_of_range(self, rotation: Float[np.ndarray, "..."], status: UInt8[np.ndarray, "..."]) -> None:
        """Put a status where an equilibrium was found that the model cannot mean."""
        status[(status == CONVERGED) & (np.abs(rotation) > self.largest_rotation)] = OUT_OF_RANGE

    def _derivative(self, items: int) -> SolvedDerivatives:
        rows = max(rows.stop for rows in self.error_columns.rows_of_stiffness.values())
        return SolvedDerivatives(
            np.empty(items),
            np.empty((items, self.error_columns.layout.end)),
            np.empty((items, rows)),
            np.empty(items),
            np.empty(items, np.uint8),
        )

    def _derivatives(self, derivative: SolvedDerivatives) -> Derivatives:
        """Return the derivatives by columns and by named stiffnesses."""
        columns = self.error_columns
        by_stiffness = {
            name: columns.stiffness[name] * derivative.by_row[:, rows].sum(axis=1)
            for name, rows in columns.rows_of_stiffness.items()
        }
        present, wave = np.flatnonzero(columns.map.nominal), columns.layout.wave

        def summed(entries: Int[np.ndarray, " entry"]) -> Float[np.ndarray, " item"]:
            start = np.zeros(len(derivative.by_value))
            return sum((columns.map.nominal[at] * derivative.by_value[:, at] for at in entries), start)

        return Derivatives(
            by_error=np.asarray((columns.matrix.T @ derivative.by_value.T).T),
            by_torque=derivative.by_value[:, columns.layout.torque],
            by_nominal=summed(present[present < wave]),
            by_form=summed(present[present >= wave]),
            by_stiffness={**by_stiffness, "pin_contact": derivative.by_pin},
            status=derivative.status,
        )


@lru_cache(maxsize=8)  # a loop is read at six torques, each with its own stiffness
def _tables_at_few(reducer: Reducer, orders: tuple[int, ...], carrier_angle: bytes) -> CondensedAngles:
    """Return the tables that this process has made before, chunk after chunk of units, or new ones."""
    return condense(reducer, orders, np.frombuffer(carrier_angle))


@lru_cache(maxsize=2)
def cached_model(reducer: Reducer, search: AngleSearch, orders: tuple[int, ...]) -> EquivalentModel:
    """Return the model of one reducer that this process has made before, with its tables, or a new one."""
    return EquivalentModel(reducer, search, orders)
