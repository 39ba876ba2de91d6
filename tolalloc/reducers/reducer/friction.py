"""What the friction of a reducer follows from: a coefficient per kind of contact, and the dimensions of bearings."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import pi
from typing import Annotated

from pydantic import Field

from tolalloc.reducers.reducer.rolling_bearing import RollingBearing

Coefficient = Annotated[float, Field(ge=0, le=0.5)]

SLIDING_FRICTION = 0.05
"""Coefficient of a disc that slides on pins in their half grooves, oil between them; an assumption [-]."""

LARGEST_CONTACT_RATIO = 2.0
"""Contact ratio up to which the friction of a gear mesh is known here [-]."""


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Coefficients of friction; table ``[friction]`` of a reducer file, all assumed unless a file states them.

    Those of bearings are SKF's for M = µ·P·d/2, ordinary lubrication included, of needle rollers, tapered rollers and
    angular-contact balls; d is taken as the pitch diameter, because files state no bore: a fifth more friction.
    """

    # A disc on a pin, or the pin in its groove: whichever slides [-]
    pins: Coefficient = SLIDING_FRICTION
    crank_disc_bearing: Coefficient = 0.0025
    crank_carrier_bearing: Coefficient = 0.0018
    carrier_bearing: Coefficient = 0.0020
    gear_mesh: Coefficient = 0.06  # µ_z, mean over the path of contact [-]


CONTACTS = {field.name: field.name.replace("_", " ").replace("crank ", "crank–") for field in fields(Friction)}
"""Kind of contact → its name."""


@dataclass(frozen=True, kw_only=True)
class FrictionDimensions:
    """Dimensions from which friction follows; none where a file states a stiffness instead."""

    crank_disc_bearing: RollingBearing | None = None  # One journal's
    crank_carrier_bearing: RollingBearing | None = None  # Both of one crankshaft as rows of one
    carrier_bearing: RollingBearing | None = None
    contact_ratio: float | None = None  # Of a sun–planet mesh [-]

    @property
    def unknown(self) -> tuple[str, ...]:
        """Kinds of contact whose friction does not follow from what the file states."""
        bearings = tuple(name for name, value in vars(self).items() if value is None and name != "contact_ratio")
        known = self.contact_ratio is not None and self.contact_ratio <= LARGEST_CONTACT_RATIO
        return bearings if known else (*bearings, "gear_mesh")


def loss_factor(first_teeth: int, second_teeth: int, contact_ratio: float) -> float:
    """Return H_v, friction work over transmitted work and coefficient of a spur gear pair, theory page (71) [-].

    Ohlendorf's π(1/z1 + 1/z2)(1 − ε + ε1² + ε2²) with the path of contact alike before and behind the pitch point,
    ε1 = ε2 = ε/2: that of gears whose profile shift balances the sliding.

    Examples
    --------
    >>> f"{loss_factor(10, 26, 1.5):.3f}"
    '0.272'
    """
    return pi * (1 / first_teeth + 1 / second_teeth) * (1 - contact_ratio + contact_ratio**2 / 2)


def friction_assumptions(friction: Friction, dimensions: FrictionDimensions) -> tuple[str, ...]:
    """Return what the numbers on friction take for granted, and what they leave out."""
    coefficients = ", ".join(f"{CONTACTS[name]} {value:g}" for name, value in vars(friction).items())
    unknown = ", ".join(CONTACTS[name] for name in dimensions.unknown)
    return (
        f"coefficients of friction: {coefficients}; the same at every speed and temperature",
        "friction: Coulomb's, at the forces without friction; no seals, no churning of grease, no flanges of rollers",
        *(
            (f"friction of {unknown}: not known, because the file states a stiffness and no dimensions",)
            * bool(unknown)
        ),
    )
