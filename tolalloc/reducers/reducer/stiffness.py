"""Stiffness of every interface: values, how well they are known, and what pins are made of.

The rows of liu2020's Table 2 for shaft, gears and bearings are in `tolalloc.reducers.reducer.table2`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from math import inf, pi
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from tolalloc.exceptions import InputError
from tolalloc.reading.files import times
from tolalloc.reading.units import GIGAPASCAL

ROUNDING = 1e-9
"""What a correlation may miss of symmetry, of 1 on its diagonal and of no negative eigenvalue [-]."""


@dataclass(frozen=True, kw_only=True)
class Stiffness:
    """Stiffness of the interfaces [N/m]."""

    sun_support: float  # K_s, support of the sun gear shaft [N/m]
    gear_mesh: float  # K_sp, one sun–planet mesh along its line of action [N/m]
    crank_disc_bearing: float  # K_pd, one crank journal in a disc bore [N/m]
    crank_carrier_bearing: float  # K_b, one crankshaft in the carrier [N/m]
    carrier_bearing: float  # K_ca, the carrier in the housing [N/m]
    pin_contact: float  # C, one pin against one disc tooth [N/m]
    # ``constant``: C at every pin; ``table2``: liu2020's K_djk on the concave part, C on the convex part;
    # ``logarithmic``: Hertzian line contact, softer under small forces, C of the flat flank as its scale
    pin_contact_law: str = "constant"
    # One pin between its supports, in series with its contact; infinite where it rests in a half groove [N/m]
    pin_bending: float = inf


@dataclass(frozen=True, kw_only=True)
class Material:
    """Elastic constants; table ``[material]``, and ``[pin_material]`` where the pins are of another one."""

    # Young's modulus E and Poisson's ratio µ [Pa, -]
    elastic_modulus: Annotated[float, Field(alias="elastic_modulus_gpa", ge=10, le=1000), times(GIGAPASCAL)]
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)]


def contact_modulus(first: Material, second: Material) -> float:
    """Return E* of two bodies in contact, 1/E* = (1 − µ1²)/E1 + (1 − µ2²)/E2 [Pa]."""
    return 1.0 / sum((1.0 - body.poisson_ratio**2) / body.elastic_modulus for body in (first, second))


@dataclass(frozen=True, kw_only=True, eq=False)
class IdentifiedStiffness:
    """Stiffnesses found from measured units, with their standard uncertainty.

    Raises
    ------
    InputError
        What is given is no correlation.
    """

    source: str  # Where the values come from
    # Field of `Stiffness` → value and standard uncertainty [N/m]
    values: dict[str, float]
    standard_uncertainty: dict[str, float]
    # Correlation of the values in their order; none of them is correlated unless given [-]
    correlation: Float[np.ndarray, "stiffness stiffness"] = field(default_factory=lambda: np.empty((0, 0)))
    notes: tuple[str, ...] = ()  # What a reader must know before trusting the values

    def __post_init__(self) -> None:
        given = self.correlation if self.correlation.size else np.eye(len(self.values))
        object.__setattr__(self, "correlation", checked_correlation(given, tuple(self.values), self.source))

    def __eq__(self, other: object) -> bool:
        """Return whether everything is the same, the order of the stiffnesses included."""
        return isinstance(other, IdentifiedStiffness) and self.content == other.content

    @property
    def content(self) -> tuple[object, ...]:
        """Everything as numbers and names that compare and print in full."""
        own = (getattr(self, item.name) for item in fields(self))
        return tuple(
            value.tolist()
            if isinstance(value, np.ndarray)
            else list(value.items())
            if isinstance(value, dict)
            else value
            for value in own
        )

    @property
    def covariance(self) -> Float[np.ndarray, "stiffness stiffness"]:
        """Covariance of the relative changes, which to first order is that of ln K, in the order of ``values`` [-]."""
        relative = np.array([self.standard_uncertainty[name] / value for name, value in self.values.items()])
        return np.asarray(self.correlation * np.outer(relative, relative))


def checked_correlation(
    rows: Sequence[Sequence[float]] | Float[np.ndarray, "row column"], names: tuple[str, ...], place: object
) -> Float[np.ndarray, "stiffness stiffness"]:
    """Return the rows as a correlation of the named stiffnesses.

    Raises
    ------
    InputError
        The rows are not square, not of this size, not symmetric, not 1 on the diagonal, not within −1…1, or have a
        negative eigenvalue.
    """
    size, field_name = len(names), "correlation"
    lengths = [len(row) for row in rows]
    if lengths != [size] * size:
        raise InputError.at(
            f"{place}",
            f"{field_name}, numbers per row,",
            lengths,
            f"{size} rows of {size}, in the order {', '.join(names)}",
        )
    matrix = np.array(rows, dtype=float).reshape(size, size)
    for (row, column), value in np.ndenumerate(matrix):
        entry = f"{field_name} of {names[row]} with {names[column]}"
        if not abs(value) <= 1.0 + ROUNDING:
            raise InputError.at(f"{place}", entry, float(value), "-1 to 1")
        if row == column and abs(value - 1.0) > ROUNDING:
            raise InputError.at(f"{place}", entry, float(value), "1, that of a stiffness with itself")
        if abs(value - matrix[column, row]) > ROUNDING:
            raise InputError.at(f"{place}", entry, float(value), f"{matrix[column, row]:g}, as in the mirrored place")
    smallest = float(np.linalg.eigvalsh(matrix)[0]) if size else 0.0
    if smallest < -ROUNDING:
        raise InputError.at(
            f"{place}", f"smallest eigenvalue of {field_name}", smallest, "0 or more, else no such values exist"
        )
    return matrix


def line_contact(face_width: float, contact_modulus: float) -> float:
    """Return C = πbE*/2, the stiffness of a pin on a flat or convex flank [N/m].

    liu2020 prints πbE/(4(1−µ²)), which it is for pin and disc of one material.

    References
    ----------
    liu2020, Table 2 (K_djk without its curvature factor).
    """
    return pi * face_width * contact_modulus / 2.0


def pin_bending(diameter: float, span: float, elastic_modulus: float) -> float:
    """Return 64/31·48EJ/l³, a solid pin on two supports, its load spread over half the span [N/m].

    References
    ----------
    Li Lixing's method, as xi2015 uses it; the factor 31/64 is not printed there [A].
    """
    return 64.0 / 31.0 * 48.0 * elastic_modulus * (pi * diameter**4 / 64.0) / span**3
