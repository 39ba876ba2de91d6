"""What one built unit does over one output turn: transmission error, orders, forces, lost motion, and their sources."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import SolveError
from tolalloc.reducers.equivalent.friction import FrictionLoop, friction_loop
from tolalloc.reducers.equivalent.hysteresis import (
    DRAWN,
    LOOP_ANGLES,
    LOST_MOTION,
    TURN_ANGLES,
    HysteresisLoop,
    both_directions,
    hysteresis_loop,
    loop_torques,
    own_load_loop,
)
from tolalloc.reducers.equivalent.model import Equilibria, EquivalentModel, Status, TurnExtremes, count_statuses
from tolalloc.reducers.equivalent.outputs import Attribution, Orders, Solved, attribute, fitted_waves, turn_orders
from tolalloc.reducers.equivalent.perfect import Preload, exact_unit, preload, rated_pin_force
from tolalloc.reducers.equivalent.springs import HARMONICS
from tolalloc.reducers.reducer.design import Reducer, at_torque
from tolalloc.reducers.unit_file import BuiltUnit


@dataclass(frozen=True, kw_only=True)
class TransmissionErrorResult:
    """One unit under one torque."""

    reducer: Reducer  # Nominal design, as given, with the measured form of the unit's parts
    unit: BuiltUnit  # Its errors
    torque: float  # Torque on the carrier; negative resists the rotation [N·m]
    equilibria: Equilibria  # At equally spaced angles of one output turn
    extremes: TurnExtremes  # Largest and smallest transmission error, refined
    preload: Preload  # What presses in this unit without torque
    rated_pin_force: float  # Largest force of a pin of exact parts under their rated torque [N]
    loop: HysteresisLoop  # Hysteresis loop of this unit and of exact parts
    # This unit's loop with every bearing under its own load; none where no bearing is given by its dimensions
    own_loads: HysteresisLoop | None
    friction: FrictionLoop | None  # This unit's with friction; none where the reducer's file does not say enough for it
    reversed_by: Float[np.ndarray, " angle"]  # What reversing the rotation adds to the curve [rad]
    attribution: Attribution | None  # Which source makes how much; none unless asked for
    orders: Orders  # Those of the transmission error that the train makes

    @cached_property
    def solved(self) -> Solved:
        """What outputs are read off."""
        return Solved.of(self.equilibria)

    def orders_over_torque(self, count: int) -> list[tuple[float, float, float, float]]:
        """Return torque [N·m], order, amplitude and phase [rad] of the strongest orders in both directions.

        What a controller takes out of the error by feedforward; a negative torque resists the forward rotation. Waves
        are cosines, by least squares at the angles of the turn.
        """
        unit, order = self.equilibria, np.array([own for own, *_ in self.orders.main(count)])
        drawn = EquivalentModel(unit.reducer, orders=self.unit.orders or HARMONICS)
        found = []
        for torque in loop_torques(unit.reducer, DRAWN).tolist():
            curve = drawn.at_torque(torque).equilibria(unit.errors, torque, unit.carrier_angle).transmission_error
            wave = fitted_waves(unit.carrier_angle, curve, order)[0]
            found += [(torque, *own) for own in zip(order, np.abs(wave), np.angle(wave), strict=True)]
        return found

    @property
    def statuses(self) -> dict[str, int]:
        """Outcome → number of angles [-]."""
        return dict(count_statuses(self.equilibria.status))


def transmission_error(
    reducer: Reducer, unit: BuiltUnit, torque: float, *, attributed: bool = False
) -> TransmissionErrorResult:
    """Return what a unit does over one output turn, and if asked for, which source makes how much of each order.

    The torque on the carrier is negative where it resists the rotation, and any but 0, where play leaves the unit
    undetermined [N·m]. TE(θc) = θ(θc) − θc, the rotation of the carrier beyond that of ideal gears, in the equilibrium
    of all springs at every carrier angle θc. Peak-to-peak is between extremes that are refined beyond the equally
    spaced angles.

    References
    ----------
    liu2020.
    """
    reducer = unit.as_built(reducer)
    model = EquivalentModel(at_torque(reducer, torque), orders=unit.orders or HARMONICS)
    errors = unit.errors(model.columns, reducer.modification.deviations)
    equilibria, extremes = model.equilibria(errors, torque), model.exact_extremes(errors, torque)
    worst, orders = Status(max(extremes.status[0], equilibria.status.max())), turn_orders(model, errors, torque)
    if worst is Status.CONVERGED and np.isnan(orders.amplitude).any():
        worst = Status.NOT_CONVERGED
    if worst is not Status.CONVERGED:
        raise SolveError(f"unit {unit.name}: no transmission error can be given, at some angle: {worst.sentence}.")
    forward, backward = both_directions(model, errors, torque)
    drawn = model.with_form(reducer.form.drawn if reducer.form else None)
    loops = [hysteresis_loop(one, row, LOOP_ANGLES) for one, row in ((model, errors), (drawn, exact_unit(model)))]
    return TransmissionErrorResult(
        reducer=reducer,
        unit=unit,
        torque=torque,
        equilibria=equilibria,
        extremes=extremes,
        preload=preload(model, errors),
        rated_pin_force=rated_pin_force(drawn.reducer),
        loop=HysteresisLoop(torque=loops[0].torque, twist=np.concatenate([loop.twist for loop in loops])),
        own_loads=own_load_loop(model, errors, TURN_ANGLES, (LOST_MOTION, 1.0)) if reducer.parts else None,
        friction=None if reducer.friction_dimensions.unknown else friction_loop(model, errors, TURN_ANGLES),
        reversed_by=(backward - forward)[0],
        attribution=attribute(model, errors, torque, orders) if attributed else None,
        orders=orders,
    )
