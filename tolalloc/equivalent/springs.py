"""The one idea of the model: every interface is a group of spring rows δ = a·q + b·ε."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, kw_only=True)
class SpringGroup:
    """Spring rows of one kind of interface at a batch of carrier angles.

    Parameters
    ----------
    name
        What the springs stand for.
    displacement
        a, compression per coordinate [m/m or m/rad].
    error
        b, compression per error column [m/m].
    columns
        Names of the error columns, each declared in exactly one group.
    stiffness
        Spring stiffness [N/m].
    contact
        ``bilateral`` springs push and pull, ``unilateral`` ones only push.

    Notes
    -----
    The energy is ½Σk·δ² (δ₊ for unilateral rows), theory page equation (5), so the stiffness matrix
    AᵀkA is symmetric by construction.
    """

    name: str
    displacement: Float[np.ndarray, "angle row coordinate"]
    error: Float[np.ndarray, "angle row column"]
    columns: tuple[str, ...]
    stiffness: Float[np.ndarray, "angle row"]
    contact: Literal["bilateral", "unilateral"] = "bilateral"


def vector_columns(name: str) -> tuple[str, str]:
    """Return the two column names of an error that is a vector in the plane."""
    return f"{name}.x", f"{name}.y"


def turned(direction: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle 2 2"]:
    """Return the rotation matrices that turn a vector fixed in a part into the housing's frame.

    Parameters
    ----------
    direction
        Angle by which the part has turned [rad].
    """
    cosine, sine = np.cos(direction), np.sin(direction)
    return np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
