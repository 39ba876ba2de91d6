"""A reducer and one of its units as a picture needs them: frozen, in millimetres and true proportion, ready for JSON.

Where each source of a drawing sits; how large every part is drawn, by what the reducer states and by one rule for what
it leaves open; what the model's equilibria say of pins and displaced parts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import pi
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from tolalloc.exceptions import SolveError, UnknownNameError
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, profile_points
from tolalloc.reducers.equivalent.condensation import (
    CondensedAngles,
    bilateral_groups,
    retained_coordinates,
    rotation_scale,
)
from tolalloc.reducers.equivalent.model import Equilibria, EquivalentModel, Status
from tolalloc.reducers.equivalent.outputs import Forces, forces
from tolalloc.reducers.equivalent.ring import ring_motion
from tolalloc.reducers.equivalent.springs import Coordinates, Positions, SpringGroup
from tolalloc.reducers.families.family import Place, first_tooth
from tolalloc.reducers.families.known import SOURCES, family_of
from tolalloc.reducers.reducer.design import Reducer

_POINTS = 22
"""Points of a tooth [-]."""
PER_CRANK_TURN = 12
"""Angles of a picture per turn of the cranks; between them it goes straight from one to the next [-]."""
_NICE = (1.0, 2.0, 5.0)


def place_of(source: str) -> str:
    """Return the id of the place that a source sits at, such as ``disc2.teeth`` of ``disc2.each_tooth.pitch``."""
    kind = SOURCES.of(source)
    if kind is None or not kind.place:
        names = [own.name for own in SOURCES.kinds if own.place]
        raise UnknownNameError.among("places of a reducer", "source", source, names)
    return kind.place_of(source)


def is_placed(source: str) -> bool:
    """Return whether the picture has a place for a source."""
    kind = SOURCES.of(source)
    return kind is not None and bool(kind.place)


def places_of(reducer: Reducer, sources: Iterable[str] = ()) -> tuple[Place, ...]:
    """Return all places of a reducer with the sources of a drawing, from the inside of the housing to the input."""
    found = {place.id: place for place in family_of(reducer).places(reducer)}
    for source in sources:
        own = place_of(source)
        if own not in found:
            raise UnknownNameError.among(f"places of {reducer.name}", "source", source, found)
        found[own] = replace(found[own], sources=(*found[own].sources, source))
    return tuple(found.values())


def _tooth(reducer: Reducer) -> dict[str, list[Any]]:
    """Return one tooth space of a disc, counter-clockwise from tip to tip about its root at angle 0.

    ``exact`` and ``modified`` are points of the profile without and with the tooth modification [mm], ``normal`` the
    unit vector into the disc [-]; the last point is left out, as it is the next space's first.

    Points of theory page equation (34), own derivation, x + iy for 0 ≤ φ ≤ π and mirrored [mm].
    """
    stage = reducer.cycloid_stage
    exact, modified = ToothProfile(stage=stage), ToothProfile.of(reducer)
    # Points stand dense where the tooth bends most; those of a space begin at the tip before it.
    flank = -profile_points(exact, _POINTS).angle[: _POINTS // 2 + 1][::-1]

    def around(flank_values: Float[np.ndarray, "point 2"]) -> list[Any]:
        # The flank turns clockwise from the root; the other one is its mirror image.
        return list(np.concatenate([flank_values[::-1], flank_values[1:] * (1.0, -1.0)])[:-1].tolist())

    return {
        "exact": around(exact.points(flank) / MILLIMETRE),
        "modified": around(modified.points(flank) / MILLIMETRE),
        "normal": around(exact.normals(flank)),
    }


@dataclass(frozen=True, kw_only=True)
class States:
    """Equilibria of one unit at the angles of a picture, for one direction of rotation."""

    torque: float  # Torque on the carrier, which resists this direction [N·m]
    force: Float[np.ndarray, "angle disc pin"]  # Normal force between every pin and every disc [N]
    gap: Float[np.ndarray, "angle disc pin"]  # Between them, negative where they are compressed [m]
    # All coordinates of the model, discs in the housing; then, if the ring gives, its way x, y at every disc [m, rad]
    displacement: Float[np.ndarray, "angle drawn"]
    transmission_error: Float[np.ndarray, " angle"]  # Carrier rotation beyond its nominal angle [rad]


@dataclass(frozen=True, kw_only=True)
class Turn:
    """What all units of a reducer share at the angles of a picture."""

    model: EquivalentModel  # The reducer, its parts as stiff as they are under the torque
    carrier_angle: Float[np.ndarray, " angle"]  # θc, equally spaced over one output turn [rad]
    tables: CondensedAngles  # Its condensed tables
    # Coordinates that pins and play touch, the others, and the lever that makes each a length [-, -, m]
    retained: Int[np.ndarray, " retained"]
    rest: Int[np.ndarray, " rest"]
    scale: Float[np.ndarray, " coordinate"]
    groups: tuple[SpringGroup, ...]  # All spring rows but those of pins
    way_by_coordinate: Float[np.ndarray, "angle row coordinate"]  # Of the bilateral rows [m/m or m/rad]
    rest_by_way: Float[np.ndarray, "angle rest row"]  # The other coordinates that belong to the rows' ways [m/m, rad/m]
    coordinates: Coordinates
    ring: Float[np.ndarray, "angle disc 2 way"]  # How far the ring goes at the discs per way that it has [m/m or m/rad]


@lru_cache(maxsize=4)
def _turn_of(model: EquivalentModel, count: int) -> Turn:
    """Return what all units of a model share at equally spaced angles [-]; remembered for the next unit."""
    angle = 2 * pi * np.arange(count) / count
    at = Positions(model.reducer, angle, model.orders)
    groups = bilateral_groups(at)
    retained = retained_coordinates(model.reducer, at.coordinates, groups)
    rest = np.setdiff1d(np.arange(at.coordinates.count), retained)
    rows = np.concatenate([group.displacement for group in groups if group.contact == "bilateral"], axis=1)
    return Turn(
        model=model,
        carrier_angle=angle,
        tables=model.tables_at(angle),
        retained=retained,
        rest=rest,
        scale=rotation_scale(model.reducer, at.coordinates),
        groups=tuple(groups),
        way_by_coordinate=rows,
        rest_by_way=np.linalg.pinv(rows[:, :, rest]),
        coordinates=at.coordinates,
        ring=ring_motion(at),
    )


def _solved_states(turn: Turn, errors: Float[np.ndarray, " column"], torque: float) -> States:
    """Return the equilibria of one unit [m, angles rad] under a torque on the carrier [N·m]."""
    equilibria = turn.model.equilibria_of(turn.tables, errors[np.newaxis], torque, turn.carrier_angle)
    worst = Status(int(equilibria.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"picture of {turn.model.reducer.name}: at some angle {worst.sentence}.")
    carried = forces(equilibria)
    return States(
        torque=torque,
        force=carried.pins[0],
        gap=-_compressions(equilibria),
        displacement=_in_the_housing(turn, _displacements(turn, equilibria, carried)),
        transmission_error=equilibria.transmission_error[0],
    )


def _compressions(equilibria: Equilibria) -> Float[np.ndarray, "angle disc pin"]:
    """Return the compression at mid-width of every pin and disc of one unit, negative where a gap is left [m].

    Summed in the order of the solver, so that no digit differs from what it balances.

    δ = D·q + H·ε, own derivation, theory page equations (17) and (21).
    """
    tables, layout = equilibria.tables, equilibria.columns.layout
    values = _values(equilibria)
    radial, tangential, radius = values[layout.pin : layout.wave].reshape(3, layout.pins)
    found = np.empty((equilibria.carrier_angle.size, *tables.contact_by_disc.shape[1::2]))
    for disc in range(found.shape[1]):
        by_error, by_disc = tables.contact_by_error[:, disc], tables.contact_by_disc[:, disc]
        undisturbed = radius + (by_error[:, 0] * radial + by_error[:, 1] * tangential)
        first = layout.wave + disc * layout.waves
        for wave in np.flatnonzero(values[first : first + layout.waves]):
            undisturbed = undisturbed + by_error[:, 2 + wave] * values[first + wave]
        first = layout.tooth + disc * 2 * layout.teeth
        for kind, own in enumerate(values[first : first + 2 * layout.teeth].reshape(2, layout.teeth)):
            if own.any():
                undisturbed = undisturbed + by_error[:, 2 + layout.waves + kind] * own[tables.tooth[:, disc]]
        if values[layout.flank]:
            undisturbed = undisturbed - np.abs(by_disc[:, 2]) * values[layout.flank]
        x, y, turn = (equilibria.retained[0, :, 3 * disc + axis, np.newaxis] for axis in range(3))
        found[:, disc] = by_disc[:, 0] * x + by_disc[:, 1] * y + by_disc[:, 2] * turn + undisturbed
    return found


def _values(equilibria: Equilibria) -> Float[np.ndarray, " value"]:
    """Return the values that the tables take of one unit, entry by entry as the solver adds them [m, rad]."""
    mapped = equilibria.columns.map
    values = mapped.nominal.copy()
    np.add.at(values, mapped.value, mapped.factor * equilibria.errors[0, mapped.column])
    return values


def _displacements(turn: Turn, equilibria: Equilibria, carried: Forces) -> Float[np.ndarray, "angle coordinate"]:
    """Return all coordinates of one unit, of which the equilibria hold those alone that pins and play touch [m, rad].

    The others follow from the ways of the springs, force over stiffness, theory page equation (5).

    q_rest = A⁺·(F/K − b·ε − A_d·q_d), own derivation.
    """
    found = np.zeros((equilibria.carrier_angle.size, turn.scale.size))
    found[:, turn.retained] = equilibria.retained[0] * turn.scale[turn.retained]
    values = _values(equilibria)
    way = carried.rows[0] / equilibria.tables.row_stiffness
    first, row = 0, 0
    for group in turn.groups:
        last = first + len(group.columns)
        if group.contact == "bilateral":
            count = group.stiffness.shape[1]
            way[:, row : row + count] -= group.error @ values[first:last]
            row += count
        first = last
    way -= np.einsum("arc,ac->ar", turn.way_by_coordinate, found)
    found[:, turn.rest] = np.einsum("acr,ar->ac", turn.rest_by_way, way)
    return found


def _in_the_housing(turn: Turn, found: Float[np.ndarray, "angle coordinate"]) -> Float[np.ndarray, "angle drawn"]:
    """Return the coordinates with the discs where they stand in the housing, the ring's own motion at them behind."""
    coordinates = turn.coordinates
    if not coordinates.ring:
        return found
    moved = np.einsum("adxw,aw->adx", turn.ring, found[:, -len(coordinates.ring) :])
    for disc in range(coordinates.disc_count):
        first = coordinates.disc(disc)
        found[:, first : first + 2] += moved[:, disc]
    return np.concatenate([found, moved.reshape(len(found), -1)], axis=1)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A reducer and one of its units as a picture needs them.

    Angles of parts grow evenly with the carrier's: angle = start + turns·θc, in the housing's frame, counter-clockwise
    positive. The picture closes after `output_turns` of the carrier; the equilibria are those of the first output turn.
    """

    reducer: str  # Name of the reducer
    unit: str  # Name of the unit
    outline: Mapping[str, float]  # Radii and counts of parts [mm, -], angles [rad]
    tooth: Mapping[str, list[Any]]  # One tooth space of a disc, `tolalloc.reducers.scene._tooth` [mm, -, rad]
    turns: Mapping[str, float]  # Turns of carrier, cranks, discs, planets and sun per output turn, with their sign [-]
    # Angles at θc = 0, one entry per crank, disc, pin or planet, and of the sun's first tooth [rad]
    start: Mapping[str, list[float]]
    # First coordinate of sun, planets, discs, carrier and, if it gives, the ring at every disc [-]
    coordinates: Mapping[str, list[int]]
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
    unit, sources
        Names of the unit and of the drawing's sources.
    per_crank_turn
        Angles per turn of the cranks [-].
    """
    own = dict(zip(model.columns, (float(value) for value in errors), strict=True))
    amounts = {name: own[f"modification.{name}"] for name in ("equidistant", "shift")}
    reducer = replace(model.reducer, modification=replace(model.reducer.modification, **amounts))
    turn = _turn_of(model.at_torque(torque), per_crank_turn * reducer.cycloid_stage.disc_teeth)
    forward, backward = (_solved_states(turn, errors, sign * abs(torque)) for sign in (-1.0, 1.0))
    outline, assumptions = family_of(reducer).outlines(reducer)
    (turns, start), first, axes = _motion(reducer), Coordinates.of(reducer), family_of(reducer).axes(reducer)
    return Scene(
        reducer=reducer.name,
        unit=unit,
        outline=outline,
        tooth=_tooth(reducer),
        turns=turns,
        start=start,
        coordinates={
            "sun": [first.input],
            "planet": [first.planet(crank) for crank in range(reducer.crank_count)],
            "disc": [first.disc(disc) for disc in range(reducer.disc_count)],
            "carrier": [first.carrier],
            **({"ring": [first.count + 2 * disc for disc in range(reducer.disc_count)]} if first.ring else {}),
        },
        output_turns=reducer.closing_turns,
        carrier_angle=turn.carrier_angle,
        forward=forward,
        backward=backward,
        offsets={place: [own[f"{name}.{axis}"] / MILLIMETRE for axis in "xy"] for place, name in axes.items()},
        places=places_of(reducer, sources),
        magnification=_magnification(reducer, forward, backward),
        assumptions=assumptions,
    )


def _motion(reducer: Reducer) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Return turns per output turn and starting angles of all parts, both read off the model's own kinematics [-; rad].

    A planet's first tooth starts where its teeth and the sun's mesh: nothing of the model depends on it.
    """
    still, turned = (Positions(reducer, np.array([angle])) for angle in (0.0, 2 * pi))
    cranks, discs = range(reducer.crank_count), range(reducer.disc_count)
    stage = reducer.cycloid_stage

    def turns(at: Any) -> float:
        return float((at(turned)[0] - at(still)[0]) / (2 * pi))

    start = {
        "carrier": [float(still.crank_position(place)[0]) for place in range(reducer.drive_count)],
        "crank": [float(still.disc_direction(disc)[0]) for disc in discs],
        "disc": [float(-still.disc_direction(disc)[0] / stage.disc_teeth) for disc in discs],
        "pin": [float(direction) for direction in still.pin_direction],
        "planet": [
            first_tooth(reducer.gears.sun_teeth, reducer.gears.planet_teeth, float(still.crank_position(crank)[0]))
            for crank in cranks
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
    for part, (angle, first) in family_of(reducer).turning(reducer).items():
        start[part], rates[part] = [first], turns(angle)
    return rates, start


def _magnification(reducer: Reducer, *states: States) -> float:
    """Return the largest of 1, 2, 5, 10, … at which no gap is drawn wider than half a pin's radius [-].

    Own derivation: m = r_rp/(2·largest gap), rounded down to 1, 2 or 5 times a power of ten.
    """
    widest = max(float(np.abs(state.gap).max()) for state in states)
    most = 0.5 * reducer.cycloid_stage.pin_radius / max(widest, 1e-9)
    tens = 10.0 ** np.floor(np.log10(max(most, 1.0)))
    return float(max(nice * tens for nice in _NICE if nice * tens <= max(most, 1.0)))
