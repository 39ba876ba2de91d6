"""What a tooth modification does to clearance and contact of exact parts."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from tolalloc.reading.units import ARCMINUTE, DEGREE, MEGAPASCAL, MICROMETRE, MICRORADIAN, MILLIMETRE
from tolalloc.reducers.contact import ContactResult, YieldingContact
from tolalloc.reducers.cycloid.clearance import FLANK, removed
from tolalloc.reducers.cycloid.loaded_contact import Assessment, LoadedContact
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, normals
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences

_say = Sentences("contact")
_METHODS = ("linear method", "law at every pin")
"""Both ways in which one disc is loaded, as legends call them."""
_ON_TERMINAL = ("quantity", "one disc, law at every pin", "all discs, bearings yielding")
"""Columns of the loaded contact that a terminal has room for; the report has all."""
_LAWS = {"logarithmic": "law_logarithmic", "constant": "law_constant", "table2": "law_table2"}
"""Contact law → what a sentence calls it."""
_FROM_CRANK = "angle of the pin from the crank direction [°]"


class ContactTeller(Teller[ContactResult]):
    """What is said of one modification under one torque."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", model=self.header.model)

    @property
    def subtitle(self) -> str:
        """Torques, face width and phases."""
        found = self.result.assessment
        gaps = {"on_disc": found.share * found.torque, "width": found.reducer.cycloid_stage.face_width / MILLIMETRE}
        return _say("subtitle", torque=self.result.torque, phases=found.single.phase.size, **gaps)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Clearance, and how the pins carry with bearings that yield and with rigid ones."""
        found, single, yielding = self.result.assessment, self.result.assessment.single, self.result.yielding
        clearance, pins = found.clearance, found.single.pins_in_contact
        law = _say(_LAWS[found.reducer.stiffness.pin_contact_law])
        play = {**self.play, "free": clearance.free_rotation / ARCMINUTE, "radial": clearance.radial / MICROMETRE}
        said = [_say("clearance", **play, first_contact=clearance.first_contact / DEGREE)]
        if yielding:
            gaps = {"pins": span(*yielding.pins_in_contact), "pressure": yielding.pressure / MEGAPASCAL}
            said.append(_say("yielding", law=law, contact=self.result, **gaps))
        most = {"force": single.force.max(), "pressure": single.pressure.max() / MEGAPASCAL}
        places = {"most_loaded": single.most_loaded / DEGREE, "most_pressed": single.most_pressed / DEGREE}
        rigid = _say("rigid", share=found.share, law=law, pins=span(pins.min(), pins.max()), **most, **places)
        return (*said, rigid)

    @property
    def play(self) -> dict[str, float]:
        """Backlash and lost motion of the whole reducer at its output [arcmin]."""
        loop = self.result.loop
        return {"backlash": loop.backlash[0] / ARCMINUTE, "lost_motion": loop.lost_motion[0] / ARCMINUTE}

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return self.result.assessment.warnings

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source prints."""
        return self.result.assessment.assumptions

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Profile and clearance, and the teeth under load."""
        found = self.result.assessment
        return (
            Section(
                heading=_say("profile_heading"),
                figures=(_profile_figure(found.profile), clearance_figure(found)),
                tables=(("profile", self._profile_table),),
            ),
            Section(
                heading=_say("load_heading"),
                paragraphs=(_say("methods"),),
                figures=(_force_figure(found), _phase_figure(found)),
                tables=(("loaded contact", self._contact_table), ("pins", self._pin_table)),
            ),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Profile, and the loaded contact by every method, units of measurement in the names."""
        found, yielding = self.result.assessment, self.result.yielding
        return {
            "reducer": self.header.model,
            "torque on the carrier [N·m]": self.result.torque,
            "torque on the more loaded disc [N·m]": found.share * found.torque,
            "face width [mm]": found.reducer.cycloid_stage.face_width / MILLIMETRE,
            "phases [-]": int(found.single.phase.size),
            **{f"{name.replace('_', ' ')} [arcmin]": value for name, value in self.play.items()},
            "profile": _profile_summary(found),
            "linear": _contact_summary(found.linear),
            "per tooth": _contact_summary(found.single),
            "all discs together": _contact_summary(found.together),
            "bearings yielding": _yielding_summary(yielding) if yielding else None,
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Profile and clearance, and the loaded contact by two methods."""
        model, table = self.header.model, self._contact_table
        shown = table[[name for name in _ON_TERMINAL if name in table]]
        title = _say("contact_on_terminal", model=model, torque=self.result.torque)
        return (self._profile_table, _say("profile_on_terminal", model=model)), (shown, title)

    @property
    def _profile_table(self) -> pd.DataFrame:
        """Profile and clearance."""
        profile = self.summary["profile"]
        return pd.DataFrame({"quantity": profile.keys(), "value": profile.values()})

    @cached_property
    def _contact_table(self) -> pd.DataFrame:
        """The loaded contact by every method side by side."""
        columns, found = {}, self.result.assessment
        for title, name, contact in (
            ("one disc, linear method", "linear", found.linear),
            ("one disc, law at every pin", "per tooth", found.single),
            ("all discs, rigid bearings", "all discs together", found.together),
        ):
            own = self.summary[name]
            pins = own["share of phases with so many pins in contact [-]"]
            columns[title] = {
                "torque [N·m]": f"{float(contact.torque[0].sum()):.4g}",
                "deflection over the phases [µm]": span(*own["deflection over the phases [µm]"]),
                "loaded zone [deg]": span(*own["loaded zone [deg]"]),
                "pins in contact on a disc, share of phases": ", ".join(f"{pin}: {at:.1%}" for pin, at in pins.items()),
                **_largest(own, f", {own['largest pin force at [deg]']:.1f}", f", {own['peak pressure at [deg]']:.1f}"),
            }
        if own := self.summary["bearings yielding"]:
            columns["all discs, bearings yielding"] = {
                "torque [N·m]": f"{own['moment about the discs [N·m]']:.4g}",
                "pins in contact on a disc, share of phases": span(*own["pins in contact on a disc [-]"]),
                **_largest(own),
            }
        frame = pd.DataFrame(columns).fillna("–")
        frame.insert(0, "quantity", frame.index)
        return frame.reset_index(drop=True)

    @property
    def _pin_table(self) -> pd.DataFrame:
        """Gap, force and pressure of every pin that could carry, with a pin in the crank direction."""
        linear, single = self.result.assessment.linear, self.result.assessment.single
        order = _carrying(single)
        return pd.DataFrame(
            {
                "pin at [deg]": single.pin_angle[0, 0, order] / DEGREE,
                "gap before load [µm]": single.gap[0, 0, order] / MICROMETRE,
                "force, linear method [N]": linear.force[0, 0, order],
                "force, law at every pin [N]": single.force[0, 0, order],
                "peak pressure, law at every pin [MPa]": single.pressure[0, 0, order] / MEGAPASCAL,
            }
        )


def span(low: float, high: float) -> str:
    """Return a range of numbers as text, one number where both ends are alike."""
    first, last = f"{low:.5g}", f"{high:.5g}"
    return first if first == last else f"{first}…{last}"


def _largest(own: dict[str, Any], force_at: str = "", pressure_at: str = "") -> dict[str, str]:
    """Return cells of the largest force, pressure and share, with where they are if that is known."""
    return {
        "largest pin force [N], at [deg]": f"{own['largest pin force [N]']:.1f}{force_at}",
        "peak pressure [MPa], at [deg]": f"{own['peak pressure [MPa]']:.0f}{pressure_at}",
        "largest share of the torque on a disc [-]": f"{own['largest share of the torque on a disc [-]']:.3f}",
    }


def _profile_summary(found: Assessment) -> dict[str, float | str | None]:
    """Return profile and clearance, units in the names."""
    profile, clearance = found.profile, found.clearance
    turned, crowning = profile.modification.rotation, profile.stage.crowning
    return {
        "equidistant amount [µm]": profile.modification.equidistant / MICROMETRE,
        "shift amount [µm]": profile.modification.shift / MICROMETRE,
        **({"rotation amount [µrad]": turned / MICRORADIAN} if turned else {}),
        **({"crowning at either end [µm]": crowning / MICROMETRE} if crowning else {}),
        "tip radius [mm]": profile.tip_radius / MILLIMETRE,
        "root radius [mm]": profile.root_radius / MILLIMETRE,
        "K1 at grinding [-]": profile.ground.shortening,
        "flank turns convex at [deg]": profile.inflection_angle / DEGREE,
        "smallest convex radius of the tooth [mm]": (profile.ground.smallest_convex_radius - profile.ground.pin_radius)
        / MILLIMETRE,
        "radial clearance at tip and root [µm]": clearance.radial / MICROMETRE,
        "clearance on the flank [µm]": profile.flank_clearance / MICROMETRE,
        "first contact at [deg]": clearance.first_contact / DEGREE,
        "free rotation of a disc on its pins [arcmin]": clearance.free_rotation / ARCMINUTE,
        "the same by exact distances [arcmin]": found.exact_clearance.free_rotation / ARCMINUTE,
        "largest clearance after the first contact [µm]": float(clearance.after.max()) / MICROMETRE,
        "formula off by at most [µm]": found.exact_clearance.formula_error / MICROMETRE,
        "distances": "exact" if clearance.exact else "linear formula",
    }


def _contact_summary(contact: LoadedContact) -> dict[str, Any]:
    """Return one loaded contact over all phases, units in the names."""
    pins = contact.pins_in_contact
    counts, times = np.unique(pins, return_counts=True)
    share = contact.torque / contact.torque.sum(axis=1, keepdims=True)
    return {
        "method": contact.method,
        "deflection [µm]": float(contact.deflection.mean()) / MICROMETRE,
        "deflection over the phases [µm]": [float(f(contact.deflection)) / MICROMETRE for f in (np.min, np.max)],
        "loaded zone [deg]": [float(value) / DEGREE for value in contact.zone.mean(axis=0)],
        "share of phases with so many pins in contact [-]": {
            str(count): float(time / pins.size) for count, time in zip(counts, times, strict=True)
        },
        "largest pin force [N]": float(contact.force.max()),
        "largest pin force at [deg]": contact.most_loaded / DEGREE,
        "peak pressure [MPa]": float(contact.pressure.max()) / MEGAPASCAL,
        "peak pressure at [deg]": contact.most_pressed / DEGREE,
        "largest share of the torque on a disc [-]": float(share.max()),
    }


def _yielding_summary(found: YieldingContact) -> dict[str, Any]:
    """Return exact parts, their bearings yielding, units in the names."""
    return {
        "pins in contact on a disc [-]": list(found.pins_in_contact),
        "largest pin force [N]": found.largest_force,
        "peak pressure [MPa]": found.pressure / MEGAPASCAL,
        "moment about the discs [N·m]": found.moment,
        "largest share of the torque on a disc [-]": found.share,
    }


def _carrying(contact: LoadedContact) -> list[int]:
    """Return the pins on the side that can carry, with a pin in the crank direction, by their angle."""
    angle = contact.pin_angle[0, 0]
    return [int(at) for at in np.argsort(angle) if angle[at] > 0]


def _profile_figure(profile: ToothProfile) -> Figure:
    """Draw one tooth, exact and with the modification magnified."""
    exact, angle = ToothProfile(stage=profile.stage), np.linspace(0.0, np.pi, 361)
    depth = removed(profile, angle)
    places, apart = exact.points(angle), depth[:, np.newaxis] * exact.normals(angle)
    largest = max(float(np.abs(depth).max()), 1e-12)
    height = exact.tip_radius - exact.root_radius
    factor = max(float(f"{0.12 * height / largest:.0e}"), 1.0)
    middle = np.exp(1j * (np.pi / profile.stage.disc_teeth + np.pi / 2))  # the tooth's middle upright

    def upright(points: np.ndarray) -> tuple[list[float], list[float]]:
        own = (points[:, 0] + 1j * points[:, 1]) * middle / MILLIMETRE
        x, y = own.real.tolist(), own.imag.tolist()
        return x + [-value for value in x[::-1]], y + y[::-1]

    drawn = (("exact tooth", places), (f"modified, {factor:g} times magnified", places + factor * apart))
    lines = tuple(Series.line(label, *upright(points)) for label, points in drawn)
    # What is removed along the normal is drawn, not the slip of points along the flank, which changes nothing.
    heads = _say("profile_figure", factor=factor), "across the tooth [mm]", "from the disc's centre [mm]"
    return Figure("profile", *heads, series=lines, equal=True)


def clearance_figure(found: Assessment) -> Figure:
    """Draw clearance and deflection against the angle, and the zone where pins carry."""
    lever = normals(found.reducer.cycloid_stage.shortening, FLANK).lever
    angle = list(FLANK / DEGREE)
    low, high = found.single.zone.mean(axis=0) / DEGREE
    lines = {"clearance": found.clearance.after}
    if found.clearance.formula_error >= 0.01 * MICROMETRE:  # else the same line as the clearance
        lines["Li Lixing's formula"] = found.clearance.formula
    lines |= {f"deflection, {name}": lever * contact.deflection.mean() for name, contact in _by_method(found)}
    return Figure(
        "clearance",
        _say("clearance_figure"),
        _FROM_CRANK,
        "clearance, deflection [µm]",
        series=tuple(Series.line(name, angle, own / MICROMETRE) for name, own in lines.items()),
        vertical=((low, f"carrying from {low:.1f}°"), (high, f"to {high:.1f}°")),
    )


def _by_method(found: Assessment) -> Iterator[tuple[str, LoadedContact]]:
    """Yield both contacts of one disc as legends call them."""
    return zip(_METHODS, (found.linear, found.single), strict=True)


def _force_figure(found: Assessment) -> Figure:
    """Draw the force of each pin."""
    angle, order = found.single.pin_angle[0, 0], _carrying(found.single)
    points = (Series.points(name, angle[order] / DEGREE, own.force[0, 0, order]) for name, own in _by_method(found))
    return Figure("forces", _say("force_figure"), _FROM_CRANK, "force [N]", series=tuple(points))


def _phase_figure(found: Assessment) -> Figure:
    """Draw how the number of pins in contact changes while one pin takes over from the next."""
    phase = list(found.single.phase / DEGREE)
    points = (Series.points(name, phase, own.pins_in_contact[:, 0].tolist()) for name, own in _by_method(found))
    heads = _say("phase_figure"), "angle from the crank direction to the next pin [°]", "pins in contact [-]"
    return Figure("pins_in_contact", *heads, series=tuple(points))


TELLER = ContactTeller
