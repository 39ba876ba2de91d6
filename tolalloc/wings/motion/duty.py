"""A duty cycle: lives of the bearings, loads and losses of its load cases, and how warm the discs become."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi, tan

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import MEGAPASCAL, MILLIMETRE
from tolalloc.reducers.equivalent.friction import FrictionAtTorque
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved
from tolalloc.reducers.equivalent.perfect import exact_unit
from tolalloc.reducers.load_case import LoadCase
from tolalloc.reducers.reducer.bearings import RollingBearing
from tolalloc.reducers.reducer.design import Reducer, at_torque
from tolalloc.reducers.reducer.idle_torque import IdleTorque, number_and_turns
from tolalloc.reducers.settings import FARTHEST_TEMPERATURE

_ANGLES = 2.0 * pi * np.arange(97) / 97
"""Angles of the output turn at which a load case is solved, a prime number of them as for loops [rad]."""
RATED_LIFE, RATED_SPEED = 6000.0, 15.0
"""Life that makers state for the rated torque at a speed of the output, assumptions [h, rpm]."""
_WEIBULL = 9.0 / 8.0
"""Slope of Weibull's distribution of the lives of roller bearings, Lundberg and Palmgren [-]."""
RESISTANCE, _PIN_CIRCLE = 0.05, 52e-3
"""Temperature of the discs above the ring over the lost power at an RV-20E's pin circle, an assumption [K/W, m]."""
_SETTLED, _STEPS = 1e-3, 200
"""Change below which a temperature has settled [K], and most steps to get there [-]."""
MAIN = "carrier_bearing"


@dataclass(frozen=True, kw_only=True)
class CaseLoads:
    """What one load case does to exact parts."""

    case: LoadCase
    share: float  # Of the time, of all load cases 1 [-]
    disc_temperature: float  # Of the discs less that of the ring [K]
    pin_force: float  # Largest of a pin [N]
    line_load: float  # Largest of a pin and tooth [N/mm]
    pressure: float  # Largest Hertz pressure of pins and teeth [MPa]
    bearing_load: Mapping[str, float]  # Kind → equivalent load of the most loaded bearing over the turn [N]
    friction_torque: float  # Of all contacts that are known, seals and grease, at the output [N·m]

    @property
    def loss(self) -> float:
        """Power that becomes heat [W]."""
        return self.friction_torque * (2.0 * pi * (self.case.speed or 0.0) / 60.0)

    @property
    def efficiency(self) -> float:
        """Overall η = T/(T + T_f) with seals and grease, of a drive of its load, theory page equation (70) [-]."""
        torque = abs(self.case.torque or 0.0)
        return torque / (torque + self.friction_torque)


@dataclass(frozen=True, kw_only=True)
class BearingLife:
    """Basic rating life of the most loaded bearing of a kind under the duty cycle."""

    kind: str  # As in `Stiffness`
    count: int  # Bearings of the kind [-]
    load_rating: float  # C of ISO 281 [N]
    load: float  # Equivalent load over the duty cycle [N]
    turns: int  # Turns of one ring against the other per turn of the output [-]
    life: float  # L10 [h]
    shares: tuple[float, ...]  # Share of the damage that each load case does [-]


@dataclass(frozen=True, kw_only=True)
class DutyResult:
    """A duty cycle and what it does."""

    reducer: Reducer
    loads: tuple[CaseLoads, ...]
    bearings: tuple[BearingLife, ...]  # Those whose dimensions the reducer's file states
    mean_torque: float  # By the makers' formula [N·m]
    mean_speed: float  # Of the output [rpm]
    resistance: float  # Temperature of the discs above the ring over the lost power [K/W]
    temperatures: tuple[float, ...]  # Of the discs above the ring, step by step until it settles [K]
    tilt: float | None  # Of the output under the largest external moment; none without one [rad]

    @property
    def mean_loss(self) -> float:
        """Mean of the lost power over the time [W]."""
        return sum(own.share * own.loss for own in self.loads)

    @property
    def catalogue_life(self) -> float:
        """Life by the makers' formula, 6,000 h·(15 rpm/n_m)·(T_0/T_m)^(10/3), theory page equation (94) [h]."""
        rated = self.reducer.load.rated_torque
        return float(RATED_LIFE * RATED_SPEED / self.mean_speed * (rated / self.mean_torque) ** (10.0 / 3.0))

    @property
    def life(self) -> float | None:
        """L10 of all bearings, (Σ L^-e)^(-1/e), e = 9/8, theory page equation (93); none where none is known [h]."""
        if not self.bearings:
            return None
        return float(sum(own.count * own.life**-_WEIBULL for own in self.bearings) ** (-1.0 / _WEIBULL))


def require_cycle(cases: Sequence[LoadCase], reducer: Reducer) -> None:
    """Refuse load cases that are no duty cycle."""
    if not cases:
        raise InputError("a duty cycle has no load case; one or more with torque and speed are needed.")
    for case in cases:
        place = f"load case {case.name}"
        for name in ("torque", "speed"):
            if getattr(case, name) is None:
                raise InputError(f"{place}: {name} is missing; a duty cycle needs torque and speed of every load case.")
        for name in ("output_angles", "compensated"):
            if given := getattr(case, name):
                raise InputError.at(place, name, given, "none in a duty cycle, which takes the whole error")
        reducer.torque_on_carrier(case.torque, place)


def duty_of(reducer: Reducer, cases: Sequence[LoadCase], resistance: float | None = None) -> DutyResult:
    """Return what a duty cycle does to exact parts.

    The discs are as warm above the ring as the mean loss makes them, one node with one resistance; a load case that
    states a temperature has its own.

    Parameters
    ----------
    cases
        Load cases with torque and speed.
    resistance
        Temperature of the discs above the ring over the lost power; unless given 0.05 K/W at an RV-20E's pin circle and
        less as the square of a larger one, an assumption [K/W].

    References
    ----------
    Theory page equations (92) to (96): ISO 281 for load rating and life, Palmgren and Miner over the cases, ΔT = R·P of
    one node, up to 50 K.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> rated = LoadCase("rated", torque=-167.0, speed=15.0)
    >>> found = duty_of(load_reducer("rv20e"), [rated])
    >>> round(found.catalogue_life), [own.kind for own in found.bearings][0]  # at rated torque and speed [h]
    (6000, 'crank_disc_bearing')
    """
    require_cycle(cases, reducer)
    if resistance is None:
        resistance = RESISTANCE * (_PIN_CIRCLE / reducer.cycloid_stage.pin_circle_radius) ** 2
    temperatures, loads = _settled(reducer, cases, resistance)
    weights = np.array([own.share * (own.case.speed or 0.0) for own in loads])
    torques = np.abs([case.torque or 0.0 for case in cases])
    return DutyResult(
        reducer=reducer,
        loads=loads,
        bearings=_bearings(reducer, loads),
        mean_torque=float(np.average(torques ** (10.0 / 3.0), weights=weights) ** 0.3),
        mean_speed=float(weights.sum()),
        resistance=resistance,
        temperatures=tuple(temperatures),
        tilt=_tilt(reducer, max(abs(case.moment) for case in cases)),
    )


def _settled(
    reducer: Reducer, cases: Sequence[LoadCase], resistance: float
) -> tuple[list[float], tuple[CaseLoads, ...]]:
    """Return the temperatures of the discs above the ring, from cold until they settle, and the loads there [K]."""
    temperatures, loads = [0.0], _loads(reducer, cases, 0.0)
    for _ in range(_STEPS):
        temperatures.append(resistance * sum(own.share * own.loss for own in loads))
        if temperatures[-1] > FARTHEST_TEMPERATURE:
            break
        if abs(temperatures[-1] - temperatures[-2]) < _SETTLED:
            return temperatures, loads
        loads = _loads(reducer, cases, temperatures[-1])
    raise SolveError(
        f"reducer {reducer.name}: the discs do not settle below {FARTHEST_TEMPERATURE:g} K above the ring; "
        "give the duty cycle less torque or speed, the teeth more clearance, or a smaller thermal resistance."
    )


def _loads(reducer: Reducer, cases: Sequence[LoadCase], warmer: float) -> tuple[CaseLoads, ...]:
    """Return the loads of every load case, its discs warmer than the ring unless it states a temperature [K]."""
    idle = IdleTorque.of(reducer).turning if reducer.friction_dimensions.has_idle else 0.0
    time = sum(case.share for case in cases)
    return tuple(_loads_of(reducer, case, case.share / time, warmer, idle) for case in cases)


def _loads_of(reducer: Reducer, case: LoadCase, share: float, warmer: float, idle: float) -> CaseLoads:
    warmer = warmer if case.disc_temperature is None else case.disc_temperature
    torque = case.torque or 0.0
    model = EquivalentModel(at_torque(reducer.with_warmer_discs(warmer), torque))
    solved = Solved.of(model.equilibria(exact_unit(model), torque, _ANGLES))
    if solved.equilibria.status.any():
        raise SolveError(f"load case {case.name} of {reducer.name}: no equilibrium under {torque:g} N·m.")
    loads = {
        kind: float(_over_turn(bearing, solved.forces.of(kind)[0]).max()) for kind, bearing in _known(reducer).items()
    }
    if case.moment and MAIN in loads:
        loads[MAIN] += abs(case.moment) / lever(reducer)
    return CaseLoads(
        case=case,
        share=share,
        disc_temperature=warmer,
        pin_force=float(solved.forces.pins.max()),
        line_load=float(solved.line_load.max()) * MILLIMETRE,
        pressure=float(solved.pressure.max()) / MEGAPASCAL,
        bearing_load=loads,
        friction_torque=float(FrictionAtTorque.of(solved).friction_torque[0]) + idle,
    )


def _over_turn(bearing: RollingBearing, force: Float[np.ndarray, "angle element"]) -> Float[np.ndarray, " element"]:
    """Return the constant load that takes as much life as that of the turn, (mean of F^p)^(1/p) [N]."""
    exponent = bearing.life_exponent
    return np.asarray((force**exponent).mean(axis=0) ** (1.0 / exponent) + bearing.rows * bearing.idle_load)


def _known(reducer: Reducer) -> dict[str, RollingBearing]:
    """Return the bearings whose dimensions the file states, by their kind."""
    dimensions = vars(reducer.friction_dimensions)
    return {kind: own for kind, own in dimensions.items() if isinstance(own, RollingBearing)}


def lever(reducer: Reducer) -> float:
    """Return the distance of the pressure centres of the main bearing's rows, w + d_m·tan α [m].

    Theory page equation (95), own derivation. One row stands on each side of the discs, which are w wide together, and
    their contact lines meet outside: an assumption.
    """
    bearing, stage = _known(reducer)[MAIN], reducer.cycloid_stage
    apart = (reducer.disc_count - 1) * stage.disc_spacing + stage.face_width
    return apart + bearing.pitch_diameter * tan(bearing.contact_angle)


def _tilt(reducer: Reducer, moment: float) -> float | None:
    """Return how far an external moment tilts the output: both rows give way, 2·δ(M/L)/L [rad]."""
    if not moment or MAIN not in _known(reducer):
        return None
    row, apart = replace(_known(reducer)[MAIN], rows=1), lever(reducer)
    return 2.0 * row.compliance(moment / apart) * moment / apart**2


def _bearings(reducer: Reducer, loads: Sequence[CaseLoads]) -> tuple[BearingLife, ...]:
    """Return the lives of all kinds of bearings that are known."""
    found = []
    for kind, bearing in _known(reducer).items():
        count, turns = number_and_turns(reducer, kind)
        load = np.array([own.bearing_load[kind] for own in loads])
        # One row at each end carries the moment, so that the most loaded row is looked at.
        rated = replace(bearing, rows=1) if kind == MAIN and any(own.case.moment for own in loads) else bearing
        hourly = 60.0 * turns * np.array([own.share * (own.case.speed or 0.0) for own in loads])
        damage = hourly / rated.life(load)
        found.append(
            BearingLife(
                kind=kind,
                count=count,
                load_rating=rated.load_rating,
                load=float(np.average(load**rated.life_exponent, weights=hourly) ** (1.0 / rated.life_exponent)),
                turns=turns,
                life=float(1.0 / damage.sum()),
                shares=tuple((damage / damage.sum()).tolist()),
            )
        )
    return tuple(found)
