"""What the modified teeth of exact parts do: clearance, and how they carry a torque by every method."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from tolalloc.reducers.cycloid.loaded_contact import Assessment, assess, pin_moment
from tolalloc.reducers.equivalent.hysteresis import HysteresisLoop
from tolalloc.reducers.equivalent.outputs import Solved, load_share
from tolalloc.reducers.equivalent.perfect import exact_loop, perfect_reducer
from tolalloc.reducers.reducer.design import Reducer


@dataclass(frozen=True, kw_only=True)
class YieldingContact:
    """Exact parts, their bearings yielding, over one pin pitch."""

    pins_in_contact: tuple[int, int]  # Fewest and most on a disc [-]
    largest_force: float  # Of a pin [N]
    pressure: float  # Peak pressure between a pin and a tooth [Pa]
    moment: float  # Of all pin forces about the centres of their discs [N·m]
    share: float  # Largest share of the torque on a disc [-]


@dataclass(frozen=True, kw_only=True)
class ContactResult:
    """One modification under one torque."""

    assessment: Assessment  # Clearance and contact; without errors they do not depend on the torque's direction
    torque: float  # Torque on the carrier; negative resists the rotation [N·m]
    # The same reducer, its bearings yielding, as `te` and `run` solve it; none where distances must be exact
    yielding: YieldingContact | None
    reducer: Reducer  # The reducer with its own contact law

    @cached_property
    def loop(self) -> HysteresisLoop:
        """Torque against twist of the whole reducer, its gaps linear whatever the modification."""
        return exact_loop(self.reducer)


def contact_of(
    reducer: Reducer, torque: float, *, law: str = "logarithmic", exact: bool | None = None, phases: int = 72
) -> ContactResult:
    """Return what the reducer's modification does under a torque on the carrier, of either sign [N·m].

    The pins carry T·(1 − 1/i) of the torque. Law, exact distances and phases are those of `assess`.

    References
    ----------
    Li Lixing's linear method as xi2015 has it; Hertz's line contact of steel on steel.
    """
    found = assess(reducer, torque, law=law, exact=exact, phases=phases)
    yielding = None if found.clearance.exact else _yielding(perfect_reducer(found.reducer, torque))
    return ContactResult(assessment=found, torque=torque, yielding=yielding, reducer=reducer)


def _yielding(solved: Solved) -> YieldingContact:
    pins = solved.forces.pins[0]
    carry = (pins > 0).sum(axis=2)
    return YieldingContact(
        pins_in_contact=(int(carry.min()), int(carry.max())),
        largest_force=float(pins.max()),
        pressure=float(solved.pressure.max()),
        moment=pin_moment(solved.equilibria.reducer, abs(solved.equilibria.torque)),
        share=float(load_share(solved.forces.pins).max()),
    )
