"""What a modification does: clearance, pins that carry, forces, pressure and backlash, in one record."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.cycloid.clearance import LARGE, Clearance, clearance_of, is_large
from tolalloc.reducers.cycloid.loaded_contact import PAIR_SHARE, LoadedContact, PressedDiscs, default_phases
from tolalloc.reducers.cycloid.pressed import pressed, pressed_linear
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, require_sound
from tolalloc.reducers.reducer.design import Reducer

_ROUNDING = 1e-12  # difference of amounts that counts as none [m]


@dataclass(frozen=True, kw_only=True)
class Assessment:
    """One modification under one torque."""

    reducer: Reducer  # The reducer, with the contact law in use
    torque: float  # Torque on the carrier [N·m]
    share: float  # Share of it on the more loaded disc [-]
    profile: ToothProfile  # The ground profile
    clearance: Clearance  # Clearance in use, linear or exact
    exact_clearance: Clearance  # Clearance by exact distances, to compare with
    linear: LoadedContact  # The more loaded disc by Li Lixing's linear method
    single: LoadedContact  # The more loaded disc by the contact law at every pin
    together: LoadedContact  # All discs turning by the same angle, their bearings rigid

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before trusting the numbers."""
        stage, amounts, found = self.reducer.cycloid_stage, self.reducer.modification, []
        if is_large(stage, amounts):
            found.append(
                f"The modification is above {LARGE / MICROMETRE:g} µm, too large for the linear formula: "
                + ("exact distances were taken." if self.clearance.exact else "ask for exact distances.")
            )
        if amounts.shift > amounts.equidistant * stage.flank_ratio + _ROUNDING:
            found.append(
                "Δr_rp·√(1−K1²) is below Δr_p: the first contact is not at arccos K1, where Li Lixing's formula "
                f"closes the gap, and the formula is off by up to {self.clearance.formula_error / MICROMETRE:.2g} µm."
            )
        if self.torque > self.reducer.load.rated_torque:
            found.append(f"The torque is above the rated {self.reducer.load.rated_torque:g} N·m.")
        return tuple(found)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source prints."""
        count, law = self.reducer.disc_count, self.reducer.stiffness.pin_contact_law
        supports = "half grooves" if self.reducer.stiffness.pin_bending == float("inf") else "two supports"
        return (
            f"the most loaded of {count} discs carries {self.share:.3g} of the torque ({PAIR_SHARE:g} of two)",
            f"{law} contact law; the pins rest in {supports}",
            "no errors: every pin and tooth at its place, discs turning about their centres",
            "lever of a pin force: that of the exact tooth",
            *self.reducer.assumptions,
        )


def disc_share(discs: int) -> float:
    """Return the share of the torque on the most loaded disc: Li Lixing's 0.55 of a pair, others in proportion [-]."""
    return 1.0 if discs == 1 else 2 * PAIR_SHARE / discs


def pin_moment(reducer: Reducer, torque: float) -> float:
    """Return the moment of all pin forces about the centres of their discs under a torque on the carrier [N·m].

    The housing holds what the sun does not, T·(1 − 1/i). All pin forces pass through the pole, e·zp from the housing's
    centre and e·zc from the disc's, so of that moment zc/zp is left about the disc.
    """
    stage = reducer.cycloid_stage
    return torque * (1.0 - 1.0 / reducer.ratio) * stage.disc_teeth / stage.pin_count


def assess(
    reducer: Reducer, torque: float, *, law: str = "logarithmic", exact: bool | None = None, phases: int = 72
) -> Assessment:
    """Return what the reducer's modification does under a torque.

    Pins bend if the reducer says so; the torque has either sign [N·m], the law is one of
    `tolalloc.reducers.cycloid.solvers.LAWS`, the phases lie within one pin pitch. Distances are exact by default
    where the
    modification is too large for the linear formula.

    Raises
    ------
    InputError
        The profile cannot be ground, interferes with the pins, or the torque is beyond any contact.
    """
    reducer = replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law=law))
    profile, torque = ToothProfile(stage=reducer.cycloid_stage, modification=reducer.modification), abs(torque)
    require_sound(profile, reducer.name)
    share, phase = disc_share(reducer.disc_count), default_phases(reducer, phases)
    one = PressedDiscs(reducer=reducer, torque=share * torque, exact=exact)
    every = PressedDiscs(reducer=reducer, torque=pin_moment(reducer, torque), discs=reducer.disc_count, exact=exact)
    return Assessment(
        reducer=reducer,
        torque=torque,
        share=share,
        profile=profile,
        clearance=one.clearance,
        exact_clearance=one.clearance if one.clearance.exact else clearance_of(profile, exact=True),
        linear=pressed_linear(one, phase),
        single=pressed(one, phase),
        together=pressed(every, phase),
    )
