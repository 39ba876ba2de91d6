"""How the ring of pins gives against what the reducer is bolted to."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, pi
from typing import Annotated

from pydantic import Field

from tolalloc.reading.files import times
from tolalloc.reading.units import ARCMINUTE, DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.reducer.stiffness import Material, Stiffness, shear_modulus

NewtonPerMetre = Annotated[float, Field(ge=1.0, le=1e7), times(1 / MICROMETRE)]
"""A stiffness that files state in N/µm [N/m]."""
NewtonMetre = Annotated[float, Field(ge=0.1, le=1e8), times(1 / ARCMINUTE)]
"""One that they state in N·m/arcmin [N·m/rad]."""
_CONE = 0.5
"""Growth of the diameter of a clamped cone over the grip, tangent of 27°; VDI 2230's are 22 to 30° [-]."""
_HEAD, _HOLE = 1.5, 1.1
"""Diameters of a bolt's bearing face and of its hole, over that of its thread [-]."""


@dataclass(frozen=True, kw_only=True)
class Bolts:
    """Bolts through the flange of the ring; table ``[housing.bolts]``, from which a rule of thumb gives stiffnesses."""

    count: Annotated[int, Field(ge=3, le=100)]
    size: Annotated[float, Field(alias="size_mm", ge=2, le=60), times(MILLIMETRE)]  # Of the thread [m]
    circle: Annotated[float, Field(alias="circle_diameter_mm", ge=10, le=3000), times(MILLIMETRE)]  # [m]
    grip: Annotated[float, Field(alias="grip_mm", ge=1, le=500), times(MILLIMETRE)]  # Clamped thickness [m]

    def stiffnesses(self, material: Material) -> dict[str, float]:
        """Return the stiffnesses of `Housing` that the clamped flange has, alike in all directions [N/m, N·m/rad].

        Every bolt clamps a cone of the flange, here a hollow cylinder of its mean diameter D: E·A/l along its axis,
        G·A/l across it; n of them on a circle of radius R. k = n·G·A/l across, k·R² about the axis, n·E·A/l·R²/2 as
        a tilt. An assumption: the bodies behind the flange, gaps between the bolts and friction are left out, so
        a real housing gives more.

        Examples
        --------
        >>> steel = Material(elastic_modulus=206e9, poisson_ratio=0.3)
        >>> found = Bolts(count=16, size=0.008, circle=0.2, grip=0.015).stiffnesses(steel)
        >>> round(found["turn"] * ARCMINUTE / 1e3, 1)  # [kN·m/arcmin]
        58.5
        """
        outer, hole = _HEAD * self.size + _CONE * self.grip, _HOLE * self.size
        area, radius = pi * (outer**2 - hole**2) / 4, self.circle / 2
        across = self.count * shear_modulus(material) * area / self.grip
        along = self.count * material.elastic_modulus * area / self.grip
        tilt = along * radius**2 / 2
        return {
            "along": across,
            "across": across,
            "turn": across * radius**2,
            "tilt_along": tilt,
            "tilt_across": tilt,
        }


@dataclass(frozen=True, kw_only=True)
class Housing:
    """Stiffness of the ring of pins against what holds it; table ``[housing]``. What is not stated is rigid.

    ``along`` is one direction of the housing, ``across`` the one 90° further. A tilt along that direction moves the
    ring there by its angle times the height above the middle of the discs. Where the axis about which it tilts does not
    lie in its plane, it also turns as it tilts.
    """

    along: Annotated[NewtonPerMetre, Field(alias="along_n_per_um")] = inf  # [N/m]
    across: Annotated[NewtonPerMetre, Field(alias="across_n_per_um")] = inf  # [N/m]
    turn: Annotated[NewtonMetre, Field(alias="turn_nm_per_arcmin")] = inf  # About its axis [N·m/rad]
    tilt_along: Annotated[NewtonMetre, Field(alias="tilt_along_nm_per_arcmin")] = inf  # [N·m/rad]
    tilt_across: Annotated[NewtonMetre, Field(alias="tilt_across_nm_per_arcmin")] = inf  # [N·m/rad]
    # Of `along`, counter-clockwise from the x axis of the housing [rad]
    direction: Annotated[float, Field(alias="direction_deg", ge=-360, le=360), times(DEGREE)] = 0.0
    # Angle by which the ring turns per angle by which it tilts [-]
    turn_per_tilt_along: Annotated[float, Field(ge=-1, le=1)] = 0.0
    turn_per_tilt_across: Annotated[float, Field(ge=-1, le=1)] = 0.0
    bolts: Bolts | None = None

    def springs(self, material: Material, radius: float) -> dict[str, float]:
        """Return the fields of `Stiffness` that it states, or its bolts where it does not, at a pin circle [N/m]."""
        stated = {way: getattr(self, way) for way in GIVES}
        found = (self.bolts.stiffnesses(material) if self.bolts else {}) | {
            way: value for way, value in stated.items() if isfinite(value)
        }
        return {f"{RING}{way}": value / radius**2 if way in ANGLES else value for way, value in found.items()}


def ways_of(stiffness: Stiffness) -> dict[str, float]:
    """Return the ways in which a ring gives and their stiffness, in the order of the model's coordinates [N/m]."""
    found = {way: float(getattr(stiffness, f"{RING}{way}")) for way in GIVES}
    return {way: value for way, value in found.items() if isfinite(value)}


GIVES, ANGLES = ("along", "across", "turn", "tilt_along", "tilt_across"), ("turn", "tilt_along", "tilt_across")
"""Ways in which a ring may give, and which of them are angles."""
RING = "ring_"
"""What the fields of `Stiffness` begin with that hold the ring."""
