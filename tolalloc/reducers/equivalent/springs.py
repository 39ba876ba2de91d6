"""The one idea of the model: every interface is a group of spring rows δ = a·q + b·ε.

With it goes where every part stands at a carrier angle, and which coordinate of the model is which.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.housing import ways_of

AtAngles = Float[np.ndarray, " angle"]
"""A number at every carrier angle, such as the angle itself [rad]."""
HARMONICS = (1, 2, 4)
"""Orders of the pitch and run-out deviations that liu2020 prints in Table 4."""


@dataclass(frozen=True)
class Coordinates:
    """Index of every displacement in the vector q: 2 + 3·cranks + 3·discs + 3 of them, and the input's turn if free.

    Where the ring of pins gives, a coordinate for each of its ways follows; then discs are where they are against it.
    """

    crank_count: int
    disc_count: int
    input_count: int = 2  # Of the sun or the input shaft, 3 where its rotation is not given
    ring: tuple[str, ...] = ()  # Ways in which the ring of pins gives, of `tolalloc.reducers.reducer.housing.GIVES`

    @classmethod
    def of(cls, reducer: Reducer) -> Coordinates:
        """Return the layout of a reducer's displacements."""
        return cls(reducer.crank_count, reducer.disc_count, reducer.input_count, tuple(ways_of(reducer.stiffness)))

    @property
    def count(self) -> int:
        """Number of coordinates, 17 for two cranks and two discs."""
        return self.carrier + 3 + len(self.ring)

    @property
    def input(self) -> int:
        """First of the sun gear's or input shaft's, Xs and Ys [m], and θs where it turns freely [rad]."""
        return 0

    @property
    def input_turns(self) -> bool:
        """Whether the rotation of the input is a coordinate."""
        return self.input_count == 3

    def planet(self, crank: int) -> int:
        """First of a planet's three, Xp and Yp [m] and θp [rad]."""
        return self.input_count + 3 * crank

    def disc(self, disc: int) -> int:
        """First of a disc's three, xd and yd [m] and θd [rad]."""
        return self.planet(self.crank_count) + 3 * disc

    @property
    def carrier(self) -> int:
        """First of the carrier's three, Xca and Yca [m] and θca [rad]."""
        return self.disc(self.disc_count)

    def of_ring(self, way: str) -> int:
        """Return that of a way of the ring, along and across [m], turn and tilts [rad]."""
        return self.carrier + 3 + self.ring.index(way)


@dataclass(frozen=True)
class Positions:
    """Directions of all parts of a reducer at the given carrier angles.

    Theory page, equations (1) to (4), exact for the nominal motion of parts without errors. Counts start at 0 here and
    at 1 in names.
    """

    reducer: Reducer  # The nominal design
    carrier_angle: Float[np.ndarray, " angle"]  # θc, counter-clockwise positive; one output turn is 0 … 2π [rad]
    # Orders of the harmonic deviations of pitch and run-out, per turn of their part [-]
    orders: tuple[int, ...] = HARMONICS

    @cached_property
    def coordinates(self) -> Coordinates:
        """The layout of q."""
        return Coordinates.of(self.reducer)

    @cached_property
    def crank_angle(self) -> AtAngles:
        """β = −zc·θc, theory page equation (1) [rad]."""
        return -self.reducer.cycloid_stage.disc_teeth * self.carrier_angle

    def disc_direction(self, disc: int) -> AtAngles:
        """β_j = β + ψ_j, the direction of a disc's centre, theory page equation (2) [rad]."""
        return self.crank_angle + 2 * np.pi * disc / self.reducer.disc_count

    def crank_position(self, crank: int) -> AtAngles:
        """P_i = θc + φ_i, direction of a crank axis or what else drives the carrier, theory page equation (3) [rad]."""
        return self.carrier_angle + 2 * np.pi * crank / self.reducer.drive_count

    def plane(self, disc: int) -> float:
        """z_j − z_0 of theory page equation (29), height of a disc's middle plane above the middle of all discs [m]."""
        return (disc - (self.reducer.disc_count - 1) / 2) * self.reducer.cycloid_stage.disc_spacing

    @cached_property
    def sun_angle(self) -> AtAngles:
        """θs = i·θc, i the turns of the sun per turn of the carrier, theory page equation (4) [rad]."""
        return self.reducer.sun_ratio * self.carrier_angle

    @cached_property
    def pinion_angle(self) -> AtAngles:
        """θ of the shaft of the motor, which a pinion on it has, theory page equation (100) [rad]."""
        return self.reducer.ratio * self.carrier_angle

    @cached_property
    def pin_direction(self) -> Float[np.ndarray, " pin"]:
        """φ_k, the direction of a pin in the housing [rad]."""
        count = self.reducer.cycloid_stage.pin_count
        return 2 * np.pi * np.arange(count) / count


@dataclass(frozen=True, kw_only=True)
class SpringGroup:
    """Spring rows of one kind of interface at a batch of carrier angles.

    The energy is ½Σk·δ² [N·m], with δ₊ for unilateral rows and (|δ| − c)₊ for elements with play, theory page equations
    (5) and (28): convex in every case, so the stiffness matrix is symmetric by construction. δ is linear in coordinates
    and errors, for displacements that are small beside the radii.
    """

    name: str  # What the springs stand for
    stiffness_name: str  # Field of `tolalloc.reducers.reducer.stiffness.Stiffness` that gives their stiffness
    displacement: Float[np.ndarray, "angle row coordinate"]  # a, compression per coordinate [m/m or m/rad]
    error: Float[np.ndarray, "angle row column"]  # b, compression per error column [m/m]
    columns: tuple[str, ...]  # Names of the error columns, each declared in exactly one group
    stiffness: Float[np.ndarray, "angle row"]  # Spring stiffness [N/m]
    # ``bilateral`` springs push and pull, ``unilateral`` ones only push, ``play`` ones push and pull beyond their
    # clearance
    contact: Literal["bilateral", "unilateral", "play"] = "bilateral"
    clearance: float = 0.0  # Nominal clearance c of every element of a ``play`` group [m]
    # Names of the deviations of each element's clearance; an element is as many successive rows as make the group even:
    # one row of a mesh, two of a bearing
    clearance_columns: tuple[str, ...] = ()
    # Further columns that change clearances → the elements that each changes, and by how much [m/m]
    clearance_terms: Mapping[str, Sequence[tuple[int, float]]] = field(default_factory=dict)
    # Those of ``columns`` that are no errors but nominal distances, which never change → their values [m]
    constants: Mapping[str, float] = field(default_factory=dict)
    # Sources that displace the bearings whose springs these are, in their order, each its own two rows alone
    places: tuple[str, ...] = ()


def with_play(group: SpringGroup, clearance: float, elements: tuple[str, ...]) -> SpringGroup:
    """Return the group with a clearance [m] in each of its elements; unchanged where there is none.

    Energy ½k·max(0, |δ| − c)² [N·m], theory page equation (28), own derivation; convex for c ≥ 0: solvers count a
    clearance that its deviations make negative as 0.

    Examples
    --------
    >>> from tolalloc.reducers.equivalent.interfaces import carrier_support
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> group = carrier_support(Positions(load_reducer("rv20e_liu2020"), np.zeros(1)))
    >>> with_play(group, 5e-6, ("carrier",)).clearance_columns
    ('carrier.clearance',)
    """
    if clearance == 0.0:
        return group
    names = tuple(f"{element}.clearance" for element in elements)
    return replace(group, contact="play", clearance=clearance, clearance_columns=names)


def vector_columns(name: str) -> tuple[str, str]:
    """Return the two column names of an error that is a vector in the plane."""
    return f"{name}.x", f"{name}.y"


class SpringRows:
    """Rows of one spring group at a batch of carrier angles, filled in one after another."""

    def __init__(self, at: Positions, rows: int) -> None:
        self.at, self.shape = at, (at.carrier_angle.size, rows)
        self.displacement = np.zeros((*self.shape, at.coordinates.count))  # per coordinate [m/m or m/rad]
        self.columns: dict[str, Float[np.ndarray, "angle row"]] = {}  # per error column [m/m or m/rad]

    def add(self, rows: int | slice, names: Sequence[str], moved: Float[np.ndarray, "... column"]) -> None:
        """Let columns, the last axis of what they move, move some rows."""
        for column, name in enumerate(names):
            self.columns.setdefault(name, np.zeros(self.shape))[:, rows] = moved[..., column]

    def group(self, name: str, stiffness_name: str, elements: tuple[str, ...] = (), **other: Any) -> SpringGroup:
        """Return the group with the stiffness and, in its elements, the clearance of an interface as in `Stiffness`."""
        reducer = self.at.reducer
        group = SpringGroup(
            name=name,
            stiffness_name=stiffness_name,
            displacement=self.displacement,
            error=np.stack(list(self.columns.values()), axis=-1),
            columns=tuple(self.columns),
            stiffness=np.full(self.shape, getattr(reducer.stiffness, stiffness_name)),
            **other,
        )
        return with_play(group, reducer.clearance_of(stiffness_name), elements)


def support(at: Positions, first: int, name: str, stiffness_name: str, part: str) -> SpringGroup:
    """Return the two springs that hold a part's axis in the housing, where its ``assembly`` may stand off.

    δ = X − a_x, Y − a_y [m], own derivation; X is the part's first coordinate, Y the next.
    """
    rows, place = SpringRows(at, 2), f"{part}.assembly"
    rows.displacement[:, [0, 1], [first, first + 1]] = 1.0
    rows.add(slice(None), vector_columns(place), -np.eye(2))
    return rows.group(name, stiffness_name, (part,), places=(place,))


def turned(direction: AtAngles) -> Float[np.ndarray, "angle 2 2"]:
    """Return the rotation matrices from a part that has turned by a direction [rad] into the housing's frame.

    [[cos, −sin], [sin, cos]], own derivation; counter-clockwise positive.
    """
    cosine, sine = np.cos(direction), np.sin(direction)
    return np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)


def harmonic_columns(name: str, orders: tuple[int, ...]) -> tuple[str, ...]:
    """Return the column names of a deviation along a ring: cosine and sine amplitude of each order."""
    return tuple(f"{name}.{wave}{order}" for order in orders for wave in ("cos", "sin"))


def harmonic_waves(angle: Float[np.ndarray, "..."], orders: tuple[int, ...]) -> Float[np.ndarray, "... wave"]:
    """Return the cosine and sine of every order at the angles [-].

    cos(n·angle), sin(n·angle), for every order n; own derivation of liu2020's pitch and run-out errors of Table 4.
    """
    return np.stack([wave(order * angle) for order in orders for wave in (np.cos, np.sin)], axis=-1)
