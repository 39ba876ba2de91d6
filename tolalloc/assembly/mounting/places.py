"""Places of a reducer, the parts that fit there, and the ways to turn them, all from its numbers of teeth.

What is left out: turning a disc or a crank over, the tooth of the spline on which a planet sits on its crank, turning
the rings of a bearing in their seats, and exchanging single pins.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd, pi
from typing import NamedTuple

from tolalloc.rv.reducer.design import Reducer


class Shift(NamedTuple):
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


_NONE = Shift()


@dataclass(frozen=True, kw_only=True)
class Turn:
    """How a part stands turned at its place against its own frame.

    Parameters
    ----------
    number
        Bores, teeth or pins that the part is turned by, as the fitter counts them [-].
    direction
        Angle by which its vectors are turned [rad].
    bores
        What becomes of the numbers of its bores.
    ring
        What becomes of its teeth or pins, and of waves along them.
    """

    number: int = 0
    direction: float = 0.0
    bores: Shift = _NONE
    ring: Shift = _NONE

    @property
    def back(self) -> Turn:
        """The turn that undoes this one."""
        bores, ring = (shift._replace(by=-shift.by) for shift in (self.bores, self.ring))
        return Turn(number=-self.number, direction=-self.direction, bores=bores, ring=ring)


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where one part of a unit goes.

    Parameters
    ----------
    name
        Place, such as ``disc2``.
    kind
        Parts that fit: all places of one kind take the same ones.
    owned
        Beginning of a column of the model, and of the own name of the error there.
    turns
        Ways to mount a part here that differ in what the unit does.
    """

    name: str
    kind: str
    owned: tuple[tuple[str, str], ...]
    turns: tuple[Turn, ...]


def housing_turn(reducer: Reducer, pins: int) -> Turn:
    """Return the housing turned by so many pins, with all that stands fixed in it."""
    shift = Shift(pins, reducer.cycloid_stage.pin_count)
    return Turn(number=pins, direction=shift.angle, ring=shift)


def carrier_turn(reducer: Reducer, bores: int) -> Turn:
    """Return the carrier turned by so many crank positions."""
    shift = Shift(bores, reducer.crank_count)
    return Turn(number=bores, direction=shift.angle, bores=shift)


def sun_turn(reducer: Reducer, teeth: int) -> Turn:
    """Return the sun meshed so many teeth on."""
    shift = Shift(teeth, reducer.first_stage.sun_teeth)
    return Turn(number=teeth, direction=shift.angle, ring=shift)


def disc_turns(reducer: Reducer, made_for: int, disc: int) -> tuple[Turn, ...]:
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
            shift = Shift(bores, cranks)
            turns.append(Turn(number=bores, direction=shift.angle, bores=shift, ring=Shift(moved, teeth)))
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
    cranks, first = reducer.crank_count, reducer.first_stage
    gears = first.sun_teeth + first.planet_teeth
    alike = cranks // gcd(cranks, reducer.cycloid_stage.disc_teeth, gears)
    fixed = ("pin.", "each_pin.", "carrier.assembly", "carrier.tilt", "carrier.clearance", "sun.assembly")
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
    sun = Place(
        name="sun",
        kind="sun",
        owned=(("sun.eccentricity", "eccentricity"), ("sun.pitch", "pitch")),
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
        turns=(Turn(),),
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
