"""What a modification does to clearance and contact, without errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tolalloc.reading.units import ARCMINUTE, DEGREE, MEGAPASCAL, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.assessment import Assessment, assess, pin_moment
from tolalloc.reducers.cycloid.loaded_contact import LoadedContact
from tolalloc.reducers.equivalent.line_load import peak_line_load, unit_pressure
from tolalloc.reducers.equivalent.outputs import Solved, load_share
from tolalloc.reducers.equivalent.perfect import perfect_reducer
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.header import Header

if TYPE_CHECKING:
    import pandas as pd


_LAWS = {
    "logarithmic": "steel line contact",
    "constant": "a constant stiffness of a pin",
    "table2": "the stiffness along the tooth of liu2020",
}
"""What a sentence calls the law of the pin forces."""


@dataclass(frozen=True, kw_only=True)
class ContactAnswer(Answer):
    """One modification under one torque."""

    kind: ClassVar[str] = "contact"
    assessment: Assessment  # Clearance and contact; without errors they do not depend on the torque's direction
    torque: float  # Torque on the carrier; negative resists the rotation [N·m]
    # The same reducer, its bearings yielding, as `te` and `run` solve it; none where distances must be exact
    yielding: Solved | None

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"{self.header.model}: what the tooth modification does"

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        found = self.assessment
        return (
            f"{self.torque:g} N·m on the carrier, {found.share * found.torque:.4g} N·m on the more loaded disc, "
            f"face width {found.reducer.cycloid_stage.face_width / MILLIMETRE:g} mm, "
            f"{found.single.phase.size} phases of the pin pitch."
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""
        single, clearance, law = self.assessment.single, self.assessment.clearance, _LAWS[self._law]
        pins = single.pins_in_contact
        return (
            f"Backlash {clearance.backlash / ARCMINUTE:.2f} arcmin, radial clearance "
            f"{clearance.radial / MICROMETRE:.1f} µm; the first pin touches at "
            f"{clearance.first_contact / DEGREE:.1f}°.",
            *self._yielding_sentence,
            f"If one disc carries {self.assessment.share:.3g} of the torque and bearings are rigid, by {law}, "
            f"{span(pins.min(), pins.max())} of its pins carry, the most loaded one {single.force.max():.0f} N at "
            f"{single.most_loaded / DEGREE:.0f}°, and the largest pressure is "
            f"{single.pressure.max() / MEGAPASCAL:.0f} MPa at {single.most_pressed / DEGREE:.0f}°.",
        )

    @property
    def _law(self) -> str:
        return self.assessment.reducer.stiffness.pin_contact_law

    @property
    def _yielding_sentence(self) -> tuple[str, ...]:
        """Return what `te` and `run` say of the reducer without errors."""
        found = self.summary["bearings yielding"]
        if found is None:
            return ()
        least, most = found["pins in contact on a disc [-]"]
        return (
            f"At {self.torque:g} N·m and with bearings that yield, by {_LAWS[self._law]}, {span(least, most)} pins of "
            f"a disc carry, the most loaded one {found['largest pin force [N]']:.0f} N, and the largest pressure is "
            f"{found['peak pressure [MPa]']:.0f} MPa.",
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return self.assessment.warnings

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs, figures and tables."""
        from tolalloc.reducers.teeth.figures import clearance_figure, force_figure, phase_figure, profile_figure

        found = self.assessment
        return (
            Section(
                heading="Profile and clearance",
                figures=(profile_figure(found.profile), clearance_figure(found)),
                tables=(("profile", self.profile_table),),
            ),
            Section(
                heading="Under load",
                paragraphs=(
                    "Linear method: Li Lixing's, forces in proportion to the compressions, the largest deflection "
                    "iterated. Law at every pin: the force law of the contact solved tooth by tooth.",
                ),
                figures=(force_figure(found), phase_figure(found)),
                tables=(("loaded contact", self.contact_table), ("pins", self.pin_table)),
            ),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""
        found = self.assessment
        return {
            "reducer": self.header.model,
            "torque on the carrier [N·m]": self.torque,
            "torque on the more loaded disc [N·m]": found.share * found.torque,
            "face width [mm]": found.reducer.cycloid_stage.face_width / MILLIMETRE,
            "phases [-]": int(found.single.phase.size),
            "profile": _profile_summary(found),
            "linear": _contact_summary(found.linear),
            "per tooth": _contact_summary(found.single),
            "all discs together": _contact_summary(found.together),
            "bearings yielding": _yielding_summary(self.yielding) if self.yielding else None,
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

    @cached_property
    def profile_table(self) -> pd.DataFrame:
        """Profile and clearance."""
        import pandas as pd

        profile = self.summary["profile"]
        return pd.DataFrame({"quantity": profile.keys(), "value": profile.values()})

    @cached_property
    def contact_table(self) -> pd.DataFrame:
        """The loaded contact by every method side by side."""
        import pandas as pd

        columns, found = {}, self.assessment
        for title, name, contact in (
            ("one disc, linear method", "linear", found.linear),
            ("one disc, law at every pin", "per tooth", found.single),
            ("all discs, rigid bearings", "all discs together", found.together),
        ):
            own = self.summary[name]
            pins = own["share of phases with so many pins in contact [-]"]
            force, pressure = own["largest pin force [N]"], own["peak pressure [MPa]"]
            columns[title] = {
                "torque [N·m]": f"{float(contact.torque[0].sum()):.4g}",
                "deflection over the phases [µm]": span(*own["deflection over the phases [µm]"]),
                "loaded zone [deg]": span(*own["loaded zone [deg]"]),
                "pins in contact on a disc, share of phases": ", ".join(f"{pin}: {at:.1%}" for pin, at in pins.items()),
                "largest pin force [N], at [deg]": f"{force:.1f}, {own['largest pin force at [deg]']:.1f}",
                "peak pressure [MPa], at [deg]": f"{pressure:.0f}, {own['peak pressure at [deg]']:.1f}",
                "largest share of the torque on a disc [-]": f"{own['largest share of the torque on a disc [-]']:.3f}",
            }
        if own := self.summary["bearings yielding"]:
            columns["all discs, bearings yielding"] = {
                "torque [N·m]": f"{own['moment about the discs [N·m]']:.4g}",
                "pins in contact on a disc, share of phases": span(*own["pins in contact on a disc [-]"]),
                "largest pin force [N], at [deg]": f"{own['largest pin force [N]']:.1f}",
                "peak pressure [MPa], at [deg]": f"{own['peak pressure [MPa]']:.0f}",
                "largest share of the torque on a disc [-]": f"{own['largest share of the torque on a disc [-]']:.3f}",
            }
        frame = pd.DataFrame(columns).fillna("–")
        frame.insert(0, "quantity", frame.index)
        return frame.reset_index(drop=True)

    @cached_property
    def pin_table(self) -> pd.DataFrame:
        """Gap, force and pressure of every pin that could carry, with a pin in the crank direction."""
        import pandas as pd

        linear, single = self.assessment.linear, self.assessment.single
        angle = single.pin_angle[0, 0]
        order = [at for at in np.argsort(angle) if angle[at] > 0]
        return pd.DataFrame(
            {
                "pin at [deg]": angle[order] / DEGREE,
                "gap before load [µm]": single.gap[0, 0, order] / MICROMETRE,
                "force, linear method [N]": linear.force[0, 0, order],
                "force, law at every pin [N]": single.force[0, 0, order],
                "peak pressure, law at every pin [MPa]": single.pressure[0, 0, order] / MEGAPASCAL,
            }
        )


def contact_answer(
    reducer: Reducer, torque: float, *, law: str = "logarithmic", exact: bool | None = None, phases: int = 72
) -> ContactAnswer:
    """Return what the reducer's modification does under a torque on the carrier; see `assess` for the rest."""
    found = assess(reducer, torque, law=law, exact=exact, phases=phases)
    linear = reducer.modification.rotation == 0.0 and not found.clearance.exact
    return ContactAnswer(
        header=Header(
            name=reducer.name,
            model=reducer.name,
            conditions={"torque on the carrier [N·m]": torque},
            assumptions=found.assumptions,
        ),
        assessment=found,
        torque=torque,
        yielding=perfect_reducer(found.reducer, torque) if linear else None,  # its gaps are the linear formula's
    )


def _profile_summary(found: Assessment) -> dict[str, float | str | None]:
    """Return profile and clearance, units in the names."""
    profile, clearance = found.profile, found.clearance
    return {
        "equidistant amount [µm]": profile.modification.equidistant / MICROMETRE,
        "shift amount [µm]": profile.modification.shift / MICROMETRE,
        "tip radius [mm]": profile.tip_radius / MILLIMETRE,
        "root radius [mm]": profile.root_radius / MILLIMETRE,
        "K1 at grinding [-]": profile.ground.shortening,
        "flank turns convex at [deg]": profile.inflection_angle / DEGREE,
        "smallest convex radius of the tooth [mm]": (profile.ground.smallest_convex_radius - profile.ground.pin_radius)
        / MILLIMETRE,
        "radial clearance at tip and root [µm]": clearance.radial / MICROMETRE,
        "clearance on the flank [µm]": profile.modification.flank_clearance(profile.stage) / MICROMETRE,
        "first contact at [deg]": clearance.first_contact / DEGREE,
        "free rotation to one side [arcmin]": clearance.rotation / ARCMINUTE,
        "backlash [arcmin]": clearance.backlash / ARCMINUTE,
        "backlash by exact distances [arcmin]": found.exact_clearance.backlash / ARCMINUTE,
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


def _yielding_summary(solved: Solved) -> dict[str, Any]:
    """Return the reducer without errors, its bearings yielding, units in the names."""
    pins, found = solved.forces.pins[0], solved.equilibria
    reducer = found.reducer
    carry = (pins > 0).sum(axis=2)
    pressure = unit_pressure(found) * np.sqrt(peak_line_load(found, solved.forces))
    return {
        "pins in contact on a disc [-]": [int(carry.min()), int(carry.max())],
        "largest pin force [N]": float(pins.max()),
        "peak pressure [MPa]": float(pressure.max()) / MEGAPASCAL,
        "moment about the discs [N·m]": pin_moment(reducer, abs(found.torque)),
        "largest share of the torque on a disc [-]": float(load_share(solved.forces.pins).max()),
    }


def span(low: float, high: float) -> str:
    """Return a range of numbers as text, one number where both ends are alike."""
    first, last = f"{low:.5g}", f"{high:.5g}"
    return first if first == last else f"{first}…{last}"
