"""A reducer and one of its units as a picture needs them: frozen, in millimetres, ready for JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import gcd, pi
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.scene.outlines import outlines, tooth
from tolalloc.reducers.scene.places import Place, places_of
from tolalloc.reducers.scene.states import States, solved_states, turn_of

PER_CRANK_TURN = 12
"""Angles of a picture per turn of the cranks; between them it goes straight from one to the next [-]."""
_NICE = (1.0, 2.0, 5.0)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A reducer and one of its units as a picture needs them.

    Angles of parts grow evenly with the carrier's: angle = start + turns·θc, in the housing's frame, counter-clockwise
    positive. The picture closes after `output_turns` of the carrier; the equilibria are those of the first output turn.
    """

    reducer: str  # Name of the reducer
    unit: str  # Name of the unit
    outline: Mapping[str, float]  # Radii and counts of parts [mm, -], angles [rad]
    tooth: Mapping[str, list[Any]]  # One tooth space of a disc, `tolalloc.reducers.scene.outlines.tooth` [mm, -, rad]
    turns: Mapping[str, float]  # Turns of carrier, cranks, discs, planets and sun per output turn, with their sign [-]
    # Angles at θc = 0, one entry per crank, disc, pin or planet, and of the sun's first tooth [rad]
    start: Mapping[str, list[float]]
    coordinates: Mapping[str, list[int]]  # First coordinate of sun, planets, discs and carrier [-]
    output_turns: int  # Turns of the carrier after which every part is where it was [-]
    carrier_angle: Float[np.ndarray, " angle"]  # θc of the equilibria, over one output turn [rad]
    forward: States  # Equilibria while the carrier turns counter-clockwise against the torque
    backward: States  # The same clockwise
    offsets: Mapping[str, list[float]]  # Place → deviation of its axis x, y in its own part's frame [mm]
    places: tuple[Place, ...]  # Where the sources sit
    magnification: float  # By which errors and gaps are drawn larger, unless the reader chooses another [-]
    assumptions: tuple[str, ...] = ()  # What the picture shows and no file states

    @cached_property
    def place_by_source(self) -> dict[str, str]:
        """Source of the drawing → id of its place."""
        return {source: place.id for place in self.places for source in place.sources}

    def angle(self, part: str, carrier_angle: float, number: int = 0) -> float:
        """Return where a part stands at a carrier angle: an entry of `start`, its number from 0 [rad]."""
        return float(self.start[part][number] + self.turns[part] * carrier_angle)


def scene_of(
    model: EquivalentModel,
    errors: Float[np.ndarray, " column"],
    torque: float,
    *,
    unit: str = "",
    sources: Iterable[str] = (),
    per_crank_turn: int = PER_CRANK_TURN,
) -> Scene:
    """Return the scene of one unit.

    Parameters
    ----------
    model
        The reducer; the stiffness of its parts is taken under the torque.
    errors
        Deviations of the unit in the order of the model's columns, the tooth modification among them [m, angles rad].
    torque
        Torque on the carrier; its magnitude resists both directions [N·m].
    unit
        Name of the unit.
    sources
        Names of the drawing's sources.
    per_crank_turn
        Angles per turn of the cranks [-].

    Raises
    ------
    SolveError
        An angle without equilibrium.
    UnknownNameError
        A source that sits at no part of the reducer.
    """
    own = dict(zip(model.columns, (float(value) for value in errors), strict=True))
    reducer = _as_modified(model.reducer, own)
    turn = turn_of(model.at_torque(torque), per_crank_turn * reducer.cycloid_stage.disc_teeth)
    forward, backward = (solved_states(turn, errors, sign * abs(torque)) for sign in (-1.0, 1.0))
    outline, assumptions = outlines(reducer)
    turns, start = _motion(reducer)
    return Scene(
        reducer=reducer.name,
        unit=unit,
        outline=outline,
        tooth=tooth(reducer),
        turns=turns,
        start=start,
        coordinates=_coordinates(reducer),
        output_turns=reducer.first_stage.sun_teeth
        // gcd(reducer.first_stage.sun_teeth, reducer.first_stage.planet_teeth * reducer.cycloid_stage.pin_count),
        carrier_angle=turn.carrier_angle,
        forward=forward,
        backward=backward,
        offsets=_offsets(reducer, own),
        places=places_of(reducer, sources),
        magnification=magnification(reducer, forward, backward),
        assumptions=assumptions,
    )


def _as_modified(reducer: Reducer, own: Mapping[str, float]) -> Reducer:
    """Return the reducer with the tooth modification that the unit's columns state."""
    amounts = {name: own[f"modification.{name}"] for name in ("equidistant", "shift")}
    return replace(reducer, modification=replace(reducer.modification, **amounts))


def _motion(reducer: Reducer) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Return turns per output turn and starting angles of all parts, both read off the model's own kinematics [-; rad].

    A planet's first tooth starts where its teeth and the sun's mesh: nothing of the model depends on it.
    """
    still, turned = (Positions(reducer, np.array([angle])) for angle in (0.0, 2 * pi))
    cranks, discs = range(reducer.crank_count), range(reducer.disc_count)
    stage, first = reducer.cycloid_stage, reducer.first_stage

    def turns(at: Any) -> float:
        return float((at(turned)[0] - at(still)[0]) / (2 * pi))

    position = [float(still.crank_position(crank)[0]) for crank in cranks]
    in_mesh = [direction * first.sun_teeth / (2 * pi) % 1.0 for direction in position]
    start = {
        "carrier": position,
        "crank": [float(still.disc_direction(disc)[0]) for disc in discs],
        "disc": [float(-still.disc_direction(disc)[0] / stage.disc_teeth) for disc in discs],
        "pin": [float(direction) for direction in still.pin_direction],
        "planet": [
            direction + pi + (ahead - 0.5) * 2 * pi / first.planet_teeth
            for direction, ahead in zip(position, in_mesh, strict=True)
        ],
        "sun": [float(still.sun_angle[0])],
    }
    rates = {
        "carrier": turns(lambda at: at.crank_position(0)),
        "crank": turns(lambda at: at.disc_direction(0)),
        "disc": turns(lambda at: -at.disc_direction(0) / stage.disc_teeth),
        "pin": 0.0,
        "planet": turns(lambda at: at.crank_angle),
        "sun": turns(lambda at: at.sun_angle),
    }
    return rates, start


def _coordinates(reducer: Reducer) -> dict[str, list[int]]:
    """Return the first coordinate of every part [-]."""
    own = Positions(reducer, np.zeros(1)).coordinates
    return {
        "sun": [own.sun],
        "planet": [own.planet(crank) for crank in range(reducer.crank_count)],
        "disc": [own.disc(disc) for disc in range(reducer.disc_count)],
        "carrier": [own.carrier],
    }


def _offsets(reducer: Reducer, own: Mapping[str, float]) -> dict[str, list[float]]:
    """Return how far the axes of features are off their places, in the frames of their parts [mm]."""
    cranks, discs = range(1, reducer.crank_count + 1), range(1, reducer.disc_count + 1)
    columns = {"sun": "sun.eccentricity"}
    columns |= {f"planet{crank}": f"planet{crank}.eccentricity" for crank in cranks}
    columns |= {f"carrier.bore{crank}": f"carrier.bore{crank}.position" for crank in cranks}
    for disc in discs:
        columns |= {f"disc{disc}.bore{crank}": f"disc{disc}.bore{crank}.position" for crank in cranks}
        columns |= {f"crank{crank}.journal{disc}": f"crank{crank}.journal{disc}.eccentricity" for crank in cranks}
    return {place: [own[f"{name}.{axis}"] / MILLIMETRE for axis in "xy"] for place, name in columns.items()}


def magnification(reducer: Reducer, *states: States) -> float:
    """Return the largest of 1, 2, 5, 10, … at which no gap is drawn wider than half a pin's radius [-].

    Examples
    --------
    A gap of 20 µm beside pins of 2 mm radius is drawn 50 times larger, 1 mm wide.
    """
    widest = max(float(np.abs(state.gap).max()) for state in states)
    most = 0.5 * reducer.cycloid_stage.pin_radius / max(widest, 1e-9)
    tens = 10.0 ** np.floor(np.log10(max(most, 1.0)))
    return float(max(nice * tens for nice in _NICE if nice * tens <= max(most, 1.0)))
