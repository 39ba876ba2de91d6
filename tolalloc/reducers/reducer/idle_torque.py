"""Torque that turns a reducer without load beside the friction of its contacts: seals, grease, preloaded rollers."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.reducer.bearings import CRANK_BEARINGS, RollingBearing
from tolalloc.reducers.reducer.design import Reducer

OUTPUT_SPEED = 15.0
"""Speed of the output at which catalogues state the rated torque; the grease is churned at it [1/min]."""
_LIP_FORCE, _LIP_COEFFICIENT = 100.0, 0.4
"""Force of a seal's lip over its circumference [N/m] and its coefficient of friction in grease [-]; assumptions."""
_VISCOSITY = 100.0
"""Kinematic viscosity of the grease's oil at running temperature; an assumption [mm²/s]."""
_LUBRICATION = {"crank_disc_bearing": 12.0, "crank_carrier_bearing": 6.0, "carrier_bearing": 2.0}
"""Palmgren's f0 of needle rollers, tapered rollers and angular-contact balls in grease [-]."""


@dataclass(frozen=True, kw_only=True)
class IdleTorque:
    """What turns a reducer without load beside its contacts, at the output [N·m].

    Theory page equation (78): one lip around the output at the pitch diameter of the carrier bearing, T = µ·q·π·d²/2,
    own derivation; grease in the bearings by Palmgren; the preload of the bearings' rollers by µ·F·d/2. All are turned
    by virtual work to the output, as cranks turn zp times as fast. A seal at the input is the motor's; churning of
    gears and discs is left out. Coefficients, viscosity and the lip's force are assumptions.
    """

    seals: float | None  # None where no carrier bearing says how large the seal is
    grease: float
    preload: float
    grease_of_carrier: float  # The part of the grease in the carrier bearing; of a stated one by the same rule

    @classmethod
    def of(cls, reducer: Reducer, speed: float = OUTPUT_SPEED) -> IdleTorque:
        """Return the torques of a reducer at a speed of its output [1/min]; those that its file states as stated."""
        stated, dimensions = reducer.friction, reducer.friction_dimensions
        bearings = {name: (getattr(dimensions, name), *number_and_turns(reducer, name)) for name in _LUBRICATION}
        known = {name: own for name, own in bearings.items() if own[0] is not None}
        main = dimensions.carrier_bearing
        grease = {
            name: count * bearing.rows * turns * grease_torque(_LUBRICATION[name], bearing, turns * speed)
            for name, (bearing, count, turns) in known.items()
        }
        by_rule = sum(grease.values())
        taken = by_rule if stated.grease is None else stated.grease
        return cls(
            seals=stated.seals if stated.seals is not None or main is None else _seal_torque(main.pitch_diameter),
            grease=taken,
            preload=sum(
                getattr(stated, name) * count * bearing.rows * bearing.idle_load * bearing.pitch_diameter / 2.0 * turns
                for name, (bearing, count, turns) in known.items()
            ),
            grease_of_carrier=taken * grease.get("carrier_bearing", 0.0) / by_rule if by_rule else 0.0,
        )

    @property
    def at_output(self) -> float:
        """What holds the output itself: its seal, as far as it is known, and the grease of its bearing [N·m]."""
        return (self.seals or 0.0) + self.grease_of_carrier

    @property
    def at_cranks(self) -> float:
        """What the grease in the bearings of the cranks takes, at the output [N·m]."""
        return self.grease - self.grease_of_carrier

    @property
    def turning(self) -> float:
        """What seals, as far as they are known, and grease take [N·m]."""
        return (self.seals or 0.0) + self.grease

    @property
    def together(self) -> float:
        """What all three take [N·m]."""
        return self.turning + self.preload


def number_and_turns(reducer: Reducer, name: str) -> tuple[int, int]:
    """Return how many bearings of a kind there are, and how often one turns in a turn of the output [-]."""
    if name not in CRANK_BEARINGS:
        return 1, 1
    journals = reducer.disc_count if name == "crank_disc_bearing" else 1
    return reducer.crank_count * journals, reducer.cycloid_stage.pin_count


def _seal_torque(diameter: float) -> float:
    """Return the friction torque of a lip seal on a shaft of a diameter [m], µ·q·π·d²/2 with assumed µ and q [N·m]."""
    return _LIP_COEFFICIENT * _LIP_FORCE * pi * diameter**2 / 2.0


def grease_torque(factor: float, bearing: RollingBearing, speed: float) -> float:
    """Return the torque of a bearing row that no load decides, f0·10⁻¹⁰·(ν·n)^(2/3)·d_m³ [N·m].

    Theory page equation (78) with d_m in mm, ν = 100 mm²/s assumed and n of one ring against the other [1/min]; below
    ν·n = 2000 the power is 160.

    References
    ----------
    A. Palmgren, Ball and Roller Bearing Engineering, 3rd ed. (1959), whose f0 the factor is.
    """
    flow = _VISCOSITY * speed
    power = flow ** (2.0 / 3.0) if flow >= 2000.0 else 160.0
    return float(factor * 1e-10 * power * (bearing.pitch_diameter / MILLIMETRE) ** 3)
