"""Places of a reducer, the parts that fit there, the ways to turn them, and the columns that their errors become.

What is left out: turning a disc or a crank over, the tooth of the spline on which a planet sits on its crank, turning
the rings of a bearing in their seats, and exchanging single pins.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import cos, gcd, pi, sin
from typing import NamedTuple

from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.reducer.design import Reducer

_WAVE = re.compile(r"(.*)\.(cos|sin)(\d+)")
_MEMBER = re.compile(r"(each_(?:pin|tooth)\.\w+)\.(\d+)(.*)")
_BORE = re.compile(r"\bbore(\d+)\b")


class RingShift(NamedTuple):
    """Turn by whole members of a ring of like ones: bores, teeth or pins.

    Parameters
    ----------
    by, of
        Members turned by, and members of the ring [-].
    """

    by: int = 0
    of: int = 1

    @property
    def angle(self) -> float:
        """The angle of the turn [rad]."""
        return 2 * pi * self.by / self.of

    def moved(self, number: int) -> int:
        """Return the number that a member takes, counted from 1; one that the ring does not have keeps its own [-]."""
        return (number - 1 + self.by) % self.of + 1 if number <= self.of else number


_NONE = RingShift()


@dataclass(frozen=True, kw_only=True)
class PartTurn:
    """How a part stands turned at its place against its own frame."""

    number: int = 0  # Bores, teeth or pins that the part is turned by, as the fitter counts them [-]
    direction: float = 0.0  # Angle by which its vectors are turned [rad]
    bores: RingShift = _NONE  # What becomes of the numbers of its bores
    ring: RingShift = _NONE  # What becomes of its teeth or pins, and of waves along them

    @property
    def back(self) -> PartTurn:
        """The turn that undoes this one."""
        bores, ring = (shift._replace(by=-shift.by) for shift in (self.bores, self.ring))
        return PartTurn(number=-self.number, direction=-self.direction, bores=bores, ring=ring)


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where one part of a unit goes."""

    name: str  # Place, such as ``disc2``
    kind: str  # Parts that fit: all places of one kind take the same ones
    owned: tuple[tuple[str, str], ...]  # Beginning of a column of the model, and of the own name of the error there
    turns: tuple[PartTurn, ...]  # Ways to mount a part here that differ in what the unit does


def housing_turn(reducer: Reducer, pins: int) -> PartTurn:
    """Return the housing turned by so many pins, with all that stands fixed in it."""
    shift = RingShift(pins, reducer.cycloid_stage.pin_count)
    return PartTurn(number=pins, direction=shift.angle, ring=shift)


def carrier_turn(reducer: Reducer, bores: int) -> PartTurn:
    """Return the carrier turned by so many crank positions."""
    shift = RingShift(bores, reducer.crank_count)
    return PartTurn(number=bores, direction=shift.angle, bores=shift)


def sun_turn(reducer: Reducer, teeth: int) -> PartTurn:
    """Return the sun meshed so many teeth on."""
    shift = RingShift(teeth, reducer.gears.sun_teeth)
    return PartTurn(number=teeth, direction=shift.angle, ring=shift)


def disc_turns(reducer: Reducer, made_for: int, disc: int) -> tuple[PartTurn, ...]:
    """Return the turns in which a disc made for one place fits another, places counted from 0.

    Notes
    -----
    A disc's teeth stand turned by −ψ_j/zc against its carrier's frame. Turned by m crank positions, the disc fits where
    its teeth fall on those of the place: where zc·m/n_crank + (difference of places)/n_disc is whole, so many teeth.
    """
    cranks, discs, teeth = reducer.crank_count, reducer.disc_count, reducer.cycloid_stage.disc_teeth
    turns = []
    for bores in range(cranks):
        moved, left = divmod(teeth * bores * discs + (disc - made_for) * cranks, cranks * discs)
        if left == 0:
            shift = RingShift(bores, cranks)
            turns.append(PartTurn(number=bores, direction=shift.angle, bores=shift, ring=RingShift(moved, teeth)))
    return tuple(turns)


def places_of(reducer: Reducer) -> tuple[Place, ...]:
    """Return the places of one unit.

    Notes
    -----
    The housing has one turn: turned by m pins, it meets the same states of the inner parts m pin pitches of the carrier
    earlier, as zc + 1 = zp, and a sun m·Z2 teeth further on. So only the start of the output turn moves.

    The carrier has n_crank turns against discs and cranks. Counting the crank positions from another one is no other
    mounting; it is possible where teeth of discs and planets fit again, and those turns of the carrier are left out.
    """
    cranks, first = reducer.crank_count, reducer.gears
    gears = first.sun_teeth + first.planet_teeth
    alike = cranks // gcd(cranks, reducer.cycloid_stage.disc_teeth, gears)
    fixed = tuple(kind.name for kind in family_of(reducer).sources.kinds if kind.fixed)
    housing = Place(
        name="housing",
        kind="housing",
        owned=(*((name, name) for name in fixed), ("housing.", "")),
        turns=(housing_turn(reducer, 0),),
    )
    carrier = Place(
        name="carrier",
        kind="carrier",
        owned=(("carrier.bore", "bore"),),
        turns=tuple(carrier_turn(reducer, bores) for bores in range(alike)),
    )
    outer = (("centre.eccentricity", "outer.eccentricity"),) if reducer.centre_gear else ()
    sun = Place(
        name="sun",
        kind="sun",
        owned=(("sun.eccentricity", "eccentricity"), ("sun.pitch", "pitch"), *outer),
        turns=tuple(sun_turn(reducer, teeth) for teeth in range(first.sun_teeth)),
    )
    # The planets' teeth meet the sun's alike at crank positions that lie whole numbers of (Z1 + Z2)/n_crank apart.
    step = cranks // gcd(gears, cranks)
    crank_places = tuple(_crank_place(crank, step) for crank in range(cranks))
    return (housing, carrier, *crank_places, *_disc_places(reducer), sun)


def _crank_place(crank: int, families: int) -> Place:
    number = crank + 1
    return Place(
        name=f"crank{number}",
        kind="crank" if families == 1 else f"crank{crank % families + 1}",
        owned=((f"planet{number}.", "planet."), (f"mesh{number}.", "mesh."), (f"crank{number}.", "")),
        turns=(PartTurn(),),
    )


def _disc_places(reducer: Reducer) -> tuple[Place, ...]:
    discs = range(reducer.disc_count)
    made_for = [next(first for first in discs if disc_turns(reducer, first, disc)) for disc in discs]
    return tuple(
        Place(
            name=f"disc{disc + 1}",
            kind=f"disc{first + 1}" if any(made_for) else "disc",
            owned=((f"disc{disc + 1}.", ""),),
            turns=disc_turns(reducer, first, disc),
        )
        for disc, first in zip(discs, made_for, strict=True)
    )


def own_name(column: str, place: Place) -> str | None:
    """Return the own name of the error that a column of the model stands for at a place, none if it is not there."""
    return next((own + column[len(model) :] for model, own in place.owned if column.startswith(model)), None)


def model_name(error: str, place: Place) -> str:
    """Return the column of the model that an error in its own name is at a place."""
    return next(model + error[len(own) :] for model, own in place.owned if error.startswith(own))


def owned_columns(columns: Iterable[str], places: Iterable[Place]) -> tuple[str, ...]:
    """Return the columns that some part at one of the places has."""
    taken = tuple(places)
    return tuple(name for name in columns if any(own_name(name, place) is not None for place in taken))


def _terms(error: str, turn: PartTurn) -> tuple[tuple[str, float], ...]:
    """Return the errors that an error becomes by a turn, and its share in each [-].

    Notes
    -----
    A wave f(θ) becomes f(θ − turn), and its two amplitudes turn as a vector does, by its order times the angle. The
    place of a single pin is counted radially and tangentially, so it keeps its components.
    """
    name = _BORE.sub(lambda bore: f"bore{turn.bores.moved(int(bore[1]))}", error)
    if member := _MEMBER.fullmatch(name):
        return ((f"{member[1]}.{turn.ring.moved(int(member[2]))}{member[3]}", 1.0),)
    if wave := _WAVE.fullmatch(name):
        angle, order = int(wave[3]) * turn.ring.angle, wave[3]
        ahead, behind = f"{wave[1]}.cos{order}", f"{wave[1]}.sin{order}"
    elif name.endswith((".x", ".y")):
        angle, ahead, behind = turn.direction, f"{name[:-1]}x", f"{name[:-1]}y"
    else:
        return ((name, 1.0),)
    if angle == 0.0:
        return ((name, 1.0),)
    return (
        ((ahead, cos(angle)), (behind, sin(angle))) if name == ahead else ((ahead, -sin(angle)), (behind, cos(angle)))
    )


def turned(errors: Mapping[str, float], turn: PartTurn) -> dict[str, float]:
    """Return the errors of a turned part, still in its own names [m, angles rad]."""
    found: dict[str, float] = {}
    for error, value in errors.items():
        for name, share in _terms(error, turn):
            found[name] = found.get(name, 0.0) + share * value
    return found


def mounted(errors: Mapping[str, float], place: Place, turn: PartTurn) -> dict[str, float]:
    """Return the columns of the model that a part's own errors give [m, angles rad].

    Notes
    -----
    Exact: the columns are linear in the errors, and a unit is the sum over its parts.
    """
    return {model_name(error, place): value for error, value in turned(errors, turn).items()}


def unmounted(deviations: Mapping[str, float], place: Place, turn: PartTurn) -> dict[str, float]:
    """Return the own errors of the part that gives these columns; those of other places are passed over."""
    named = ((own_name(column, place), value) for column, value in deviations.items())
    return turned({name: value for name, value in named if name is not None}, turn.back)
