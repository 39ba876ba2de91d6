"""The one idea of the model: every interface is a group of spring rows δ = a·q + b·ε."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, kw_only=True)
class SpringGroup:
    """Spring rows of one kind of interface at a batch of carrier angles.

    The energy is ½Σk·δ², with δ₊ for unilateral rows and (|δ| − c)₊ for elements with play, theory page equations (5)
    and (28): convex in every case, so the stiffness matrix is symmetric by construction.
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


def with_play(group: SpringGroup, clearance: float, elements: tuple[str, ...]) -> SpringGroup:
    """Return the group with a clearance [m] in each of its elements; unchanged where there is none."""
    if clearance == 0.0:
        return group
    names = tuple(f"{element}.clearance" for element in elements)
    return replace(group, contact="play", clearance=clearance, clearance_columns=names)


def vector_columns(name: str) -> tuple[str, str]:
    """Return the two column names of an error that is a vector in the plane."""
    return f"{name}.x", f"{name}.y"


def turned(direction: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle 2 2"]:
    """Return the rotation matrices from a part that has turned by a direction [rad] into the housing's frame."""
    cosine, sine = np.cos(direction), np.sin(direction)
    return np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)


def harmonic_columns(name: str, orders: tuple[int, ...]) -> tuple[str, ...]:
    """Return the column names of a deviation along a ring: cosine and sine amplitude of each order."""
    return tuple(f"{name}.{wave}{order}" for order in orders for wave in ("cos", "sin"))


def harmonic_waves(angle: Float[np.ndarray, "..."], orders: tuple[int, ...]) -> Float[np.ndarray, "... wave"]:
    """Return the cosine and sine of every order at the angles [-]."""
    return np.stack([wave(order * angle) for order in orders for wave in (np.cos, np.sin)], axis=-1)
