"""Exact parts, modified as drawn, their bearings yielding: the one answer on forces that every command gives.

What units press without any torque, what turning them takes, and how stiff a reducer is against its catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import inf, pi

import numpy as np
from jaxtyping import Float, Integer, UInt8

from tolalloc.reducers.equivalent.condensation import bilateral_groups
from tolalloc.reducers.equivalent.friction import sliding_ways
from tolalloc.reducers.equivalent.hysteresis import BACKLASH, TURN_ANGLES, HysteresisLoop, hysteresis_loop
from tolalloc.reducers.equivalent.model import Curves, EquivalentModel, Errors, Weights
from tolalloc.reducers.equivalent.outputs import Solved
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.reducer.design import Reducer, at_torque, compliances

PHASES = 72
"""Phases of one pin pitch at which exact parts are solved, for forces over the turn [-]."""
PRELOAD_ASSUMPTION = "friction torque of the pins without load: discs sliding on pins alone, largest over the turn"


def exact_unit(model: EquivalentModel) -> Float[np.ndarray, "1 column"]:
    """Return the errors of a unit whose parts are exact and whose teeth are modified as drawn [m, angles rad]."""
    deviations: Mapping[str, float] = model.reducer.modification.deviations
    return np.array([[deviations.get(name, 0.0) for name in model.columns]])


def exact_loop(reducer: Reducer) -> HysteresisLoop:
    """Return torque against twist of the unit whose parts are exact and whose teeth are modified as drawn."""
    model = EquivalentModel(reducer)
    return hysteresis_loop(model, exact_unit(model), TURN_ANGLES)


def perfect_reducer(reducer: Reducer, torque: float) -> Solved:
    """Return equilibria and forces of exact parts over one pin pitch of the crank.

    Its modification and the stiffness of its parts under the torque on the carrier, negative where it resists the
    rotation [N·m], are in force. While the carrier turns by a pin pitch over the teeth of a disc, 2π/(zp·zc), the crank
    direction meets every phase of the pins, and all else repeats: own derivation.
    """
    model, stage = EquivalentModel(at_torque(reducer, torque)), reducer.cycloid_stage
    span = 2.0 * pi / (stage.pin_count * stage.disc_teeth)
    return Solved.of(model.equilibria(exact_unit(model), torque, span * np.arange(PHASES) / PHASES))


@dataclass(frozen=True, kw_only=True)
class Preload:
    """What presses in a unit without torque: under the 0.01 % of the rated torque at which backlash is read."""

    pin_force: Float[np.ndarray, " sample"]  # Largest force of a pin over one output turn [N]
    friction_torque: Float[np.ndarray, " sample"]  # Largest of the pins over the turn, at the output [N·m]
    status: UInt8[np.ndarray, " sample"]  # Worst status of the turn [-]


def preload(model: EquivalentModel, errors: Errors) -> Preload:
    """Return what presses in every unit without torque.

    A disc turns against the housing about its pole, so at a pin it slides with the output speed times the distance of
    contact and pole, R_p·√S − r_rp; friction torque µ·ΣF·(R_p·√S − r_rp).

    Theory page equation (69), own derivation, at 23 angles of the turn [N, N·m]; µ of the reducer's file, 0.05 unless
    stated, is assumed.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> model = EquivalentModel(load_reducer("rv20e"))
    >>> f"{float(preload(model, exact_unit(model)).pin_force[0]):.2g}"  # 0.01 % of the rated torque alone [N]
    '0.23'
    """
    return _preload_of(_without_torque(model, errors))


def _preload_of(solved: Solved) -> Preload:
    """Return what presses, from equilibria and forces without torque."""
    reducer, found = solved.equilibria.reducer, solved.forces.pins
    ways = sliding_ways(reducer, TURN_ANGLES)
    return Preload(
        pin_force=np.asarray(found.max(axis=(1, 2, 3))),
        friction_torque=reducer.friction.pins * np.einsum("sadp,adp->sa", found, ways).max(axis=1),
        status=np.asarray(solved.equilibria.status.max(axis=1)),
    )


def _without_torque(model: EquivalentModel, errors: Errors) -> Solved:
    """Return equilibria and forces over an output turn under the torque at which backlash is read."""
    torque = -BACKLASH * model.reducer.load.rated_torque
    return Solved.of(model.at_torque(torque).equilibria(errors, torque, TURN_ANGLES))


Derived = tuple[Float[np.ndarray, " sample"], Float[np.ndarray, "sample column"], UInt8[np.ndarray, " sample"]]
"""A number of every unit, its derivatives by every error column, and the worst status of the turn."""


def pin_force_derivatives(model: EquivalentModel, errors: Errors) -> Derived:
    """Return the largest pin force without torque [N] and its derivatives [N/m].

    Those of that pin's force at that angle, theory page equation (23), own derivation: the adjoint of the equilibrium
    with the force in place of the rotation. They hold while the same pins touch and the same one is pressed most.
    """
    solved = _without_torque(model, errors)
    pins = solved.forces.pins
    at, largest = _largest(pins.max(axis=(2, 3))), pins.reshape(*pins.shape[:2], -1).argmax(axis=2)
    weights = np.zeros((len(errors), pins[0, 0].size))
    weights[np.arange(len(errors)), largest[np.arange(len(errors)), at]] = 1.0
    slopes = _slopes(model, solved, at, weights.reshape(-1, *pins.shape[2:]))
    found = _preload_of(solved)
    return found.pin_force, slopes, found.status


def friction_torque_derivatives(model: EquivalentModel, errors: Errors) -> Derived:
    """Return the friction torque without load [N·m] and its derivatives [N·m/m].

    As `pin_force_derivatives`, own derivation, of the sum of forces times sliding ways at the angle where it is
    largest.
    """
    solved = _without_torque(model, errors)
    by_force = model.reducer.friction.pins * sliding_ways(model.reducer, TURN_ANGLES)
    at = _largest(np.einsum("sadp,adp->sa", solved.forces.pins, by_force))
    found = _preload_of(solved)
    return found.friction_torque, _slopes(model, solved, at, by_force[at]), found.status


def _largest(over_turn: Curves) -> Integer[np.ndarray, " sample"]:
    """Return where each is largest, anywhere where nothing converged."""
    return np.asarray(np.nan_to_num(over_turn, nan=-inf).argmax(axis=1))


def _slopes(model: EquivalentModel, solved: Solved, at: Integer[np.ndarray, " sample"], weights: Weights) -> Errors:
    """Return the derivatives of the weighted sum of the forces at one angle of every sample."""
    errors, torque = solved.equilibria.errors, solved.equilibria.torque
    return model.at_torque(torque).pin_force_derivatives(errors, torque, TURN_ANGLES, at, weights).by_error


@lru_cache(maxsize=256)
def rated_pin_force(reducer: Reducer) -> float:
    """Return the largest force of a pin of exact parts under their rated torque, which resists [N]; own derivation."""
    return float(perfect_reducer(reducer, -reducer.load.rated_torque).forces.pins.max())


@dataclass(frozen=True)
class TwistShare:
    """What one part yields of the twist."""

    part: str
    share: float  # Of the twist [-]
    stiffness: float  # Under its force; NaN of pins and teeth, whose stiffness changes with the angle [N/m]


def twist_shares(reducer: Reducer) -> tuple[TwistShare, ...]:
    """Return which part yields how much of the twist of exact parts at rated torque, the largest share first.

    By virtual work T·θ is the sum of force times way over all springs, each interface divided among its parts by their
    compliances; what is left is that of pins and teeth, their clearance included. Mean over a pin pitch.

    T·θ = Σ F²/K [N·m] over all springs, K of parts in series shared as 1/K_part; theory page equation (68), own
    derivation, of stiffnesses as they are at rated torque.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = twist_shares(load_reducer("rv20e"))
    >>> found[0].part, round(found[0].share, 2), round(sum(own.share for own in found), 6)
    ('crank bending, all journals', 0.38, 1.0)
    """
    perfect = perfect_reducer(reducer, -reducer.load.rated_torque)
    solved, found = perfect.equilibria, perfect.forces
    own, torque = solved.reducer, solved.torque
    work = torque * float(solved.transmission_error.mean())
    rows, left, parts = [], 1.0, compliances(own, torque)
    for group in bilateral_groups(Positions(own, np.zeros(1))):
        interface, stiffness = group.stiffness_name, float(group.stiffness[0, 0])
        share = float((found.of(interface) ** 2).sum(axis=2).mean() / stiffness / work)
        left -= share
        plain = {interface.replace("_", " ").replace("crank ", "crank–"): 1.0 / stiffness}
        for name, compliance in parts.get(interface, plain).items():
            rows.append(TwistShare(name, share * compliance * stiffness, 1.0 / compliance))
    rows.append(TwistShare("pins and teeth, with their clearance", left, np.nan))
    return tuple(sorted(rows, key=lambda own: -round(100.0 * own.share, 2)))
