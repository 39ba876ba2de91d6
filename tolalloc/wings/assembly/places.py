"""Places of a reducer, the parts that fit there, the ways to turn them, and the columns that their errors become.

What is left out: turning a disc or a crank over, the tooth of the spline on which a planet sits on its crank, turning
the rings of a bearing in their seats, and exchanging single pins.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from math import cos, gcd, pi, sin
from typing import NamedTuple

from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.springs import harmonic_columns, vector_columns
from tolalloc.reducers.families.known import SOURCES, family_of
from tolalloc.reducers.reducer.design import Reducer


class RingShift(NamedTuple):
    """Turn by whole members of a ring of like ones: bores, teeth or pins."""

    by: int = 0  # Members turned by [-]
    of: int = 1  # Members of the ring [-]

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
class MountingPlace:
    """Where one part of a unit goes."""

    name: str  # Place, such as ``disc2``
    kind: str  # Parts that fit: all places of one kind take the same ones
    owned: Mapping[str, str]  # Source of the model → its name on the part
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


def places_of(reducer: Reducer) -> tuple[MountingPlace, ...]:
    """Return the places of one unit.

    The housing has one turn: turned by m pins, it meets the same states of the inner parts m pin pitches of the carrier
    earlier, as zc + 1 = zp, and a sun m·Z2 teeth further on. So only the start of the output turn moves.

    The carrier has n_crank turns against discs and cranks. Counting the crank positions from another one is no other
    mounting; it is possible where teeth of discs and planets fit again, and those turns of the carrier are left out.
    """
    cranks, first = reducer.crank_count, reducer.gears
    gears = first.sun_teeth + first.planet_teeth
    alike = cranks // gcd(cranks, reducer.cycloid_stage.disc_teeth, gears)
    # The planets' teeth meet the sun's alike at crank positions that lie whole numbers of (Z1 + Z2)/n_crank apart.
    step = cranks // gcd(gears, cranks)
    discs = range(reducer.disc_count)
    made_for = [next(first for first in discs if disc_turns(reducer, first, disc)) for disc in discs]
    # Place → parts that fit there and their turns
    turns = {
        "housing": ("housing", (housing_turn(reducer, 0),)),
        "carrier": ("carrier", tuple(carrier_turn(reducer, bores) for bores in range(alike))),
    }
    for crank in range(cranks):
        turns[f"crank{crank + 1}"] = "crank" if step == 1 else f"crank{crank % step + 1}", (PartTurn(),)
    for disc, first_disc in enumerate(made_for):
        kind = f"disc{first_disc + 1}" if any(made_for) else "disc"
        turns[f"disc{disc + 1}"] = kind, disc_turns(reducer, first_disc, disc)
    turns["sun"] = "sun", tuple(sun_turn(reducer, teeth) for teeth in range(first.sun_teeth))
    owned = _owned(reducer)
    return tuple(
        MountingPlace(name=name, kind=kind, owned=owned[name], turns=ways) for name, (kind, ways) in turns.items()
    )


def _owned(reducer: Reducer) -> dict[str, dict[str, str]]:
    """Return part as mounted → source → its name on the part, as the sources declare it."""
    owned: dict[str, dict[str, str]] = defaultdict(dict)
    numbers = product(range(1, reducer.crank_count + 1), range(1, reducer.disc_count + 1))
    for (i, j), kind in product(numbers, family_of(reducer).sources.kinds):
        part, name = (text.format(i=i, j=j) for text in kind.mounted)
        owned[part][kind.name.format(i=i, j=j)] = name
    return owned


def own_name(column: str, place: MountingPlace) -> str | None:
    """Return the own name of the error that a column of the model stands for at a place, none if it is not there."""
    source = source_name(column)
    return place.owned[source] + column[len(source) :] if source in place.owned else None


def owned_columns(columns: Iterable[str], places: Iterable[MountingPlace]) -> tuple[str, ...]:
    """Return the columns that some part at one of the places has."""
    taken = tuple(places)
    return tuple(name for name in columns if any(own_name(name, place) is not None for place in taken))


def _terms(column: str, turn: PartTurn) -> tuple[tuple[str, float], ...]:
    """Return the columns that an error becomes by a turn, and its share in each [-].

    A wave f(θ) becomes f(θ − turn), and its two amplitudes turn as a vector does, by its order times the angle. The
    place of a single pin is counted radially and tangentially, so it keeps its components.
    """
    kind = SOURCES.of_column(column)
    if kind.each:
        number = kind.member(column)
        member = turn.ring.moved(int(column[number]))
        return ((f"{column[: number.start]}{member}{column[number.stop :]}", 1.0),)
    numbers = kind.numbers(column)
    source = kind.name.format(**numbers | {"i": str(turn.bores.moved(int(numbers.get("i", "1"))))})
    name = source + column[len(numbers["source"]) :]
    if kind.shape == "waves":
        order = int(numbers["order"])
        angle, (ahead, behind) = order * turn.ring.angle, harmonic_columns(source, (order,))
    else:
        angle, (ahead, behind) = turn.direction, vector_columns(source)
    if kind.shape == "number" or angle == 0.0:
        return ((name, 1.0),)
    return (
        ((ahead, cos(angle)), (behind, sin(angle))) if name == ahead else ((ahead, -sin(angle)), (behind, cos(angle)))
    )


def _turned(columns: Mapping[str, float], turn: PartTurn) -> dict[str, float]:
    """Return the columns of a turned part [m, angles rad]."""
    sums: dict[str, float] = defaultdict(float)
    for column, value in columns.items():
        for name, share in _terms(column, turn):
            sums[name] += share * value
    return sums


def mounted(errors: Mapping[str, float], place: MountingPlace, turn: PartTurn) -> dict[str, float]:
    """Return the columns of the model that a part's own errors give [m, angles rad].

    Exact: the columns are linear in the errors, and a unit is the sum over its parts.
    """
    named = {own: source for source, own in place.owned.items()}
    columns = {}
    for error, value in errors.items():
        own = source_name(error)
        columns[named.get(own, f"{place.name}.{own}") + error[len(own) :]] = value
    return _turned(columns, turn)


def unmounted(deviations: Mapping[str, float], place: MountingPlace, turn: PartTurn) -> dict[str, float]:
    """Return the own errors of the part that gives these columns; those of other places are passed over."""
    here = {column: value for column, value in deviations.items() if own_name(column, place) is not None}
    named = ((own_name(column, place), value) for column, value in _turned(here, turn.back).items())
    return {name: value for name, value in named if name is not None}
