"""What moves a virtual prototype and what damps it."""

from __future__ import annotations

from dataclasses import dataclass

from tolalloc.exceptions import InputError
from tolalloc.rv.multibody.time_course import TimeCourse


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What moves the reducer.

    Parameters
    ----------
    speed
        Of the input [rad/s].
    torque
        On the carrier, negative against the rotation [N·m].
    """

    speed: TimeCourse
    torque: TimeCourse


@dataclass(frozen=True, kw_only=True)
class Damping:
    """What takes energy out of vibrations; contacts of pins and teeth take none.

    Parameters
    ----------
    bearings
        Damping over stiffness of all bearings [s].
    output
        Torque on the carrier over what its speed lacks of the nominal one [N·m·s/rad].

    Raises
    ------
    InputError
        One of them is negative.
    """

    bearings: float
    output: float

    def __post_init__(self) -> None:
        for name, value in (("bearings", self.bearings), ("output", self.output)):
            if not 0.0 <= value < float("inf"):
                raise InputError.at("virtual prototype", f"damping of {name}", value, "a number of 0 or more")
