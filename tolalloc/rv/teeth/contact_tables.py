"""What a modification does to clearance and contact, as numbers, sentences and tables with units in every name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from tolalloc.rv.cycloid.assessment import Assessment
from tolalloc.rv.cycloid.loaded_contact import LoadedContact
from tolalloc.units import ARCMINUTE, DEGREE, MEGAPASCAL, MICROMETRE, MILLIMETRE


def profile_summary(found: Assessment) -> dict[str, float | str | None]:
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


def contact_summary(contact: LoadedContact) -> dict[str, Any]:
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


def summary(found: Assessment) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    return {
        "reducer": found.reducer.name,
        "torque on the carrier [N·m]": found.torque,
        "torque on the more loaded disc [N·m]": found.share * found.torque,
        "face width [mm]": found.reducer.cycloid_stage.face_width / MILLIMETRE,
        "phases [-]": int(found.single.phase.size),
        "profile": profile_summary(found),
        "linear": contact_summary(found.linear),
        "per tooth": contact_summary(found.single),
        "all discs together": contact_summary(found.together),
        "warnings": list(found.warnings),
        "assumptions": list(found.assumptions),
    }


def profile_table(found: Assessment) -> pd.DataFrame:
    """Return profile and clearance as a table."""
    return pd.DataFrame({"quantity": profile_summary(found).keys(), "value": profile_summary(found).values()})


def span(low: float, high: float) -> str:
    """Return a range of numbers as text, one number where both ends are alike."""
    first, last = f"{low:.5g}", f"{high:.5g}"
    return first if first == last else f"{first}…{last}"


def contact_table(found: Assessment) -> pd.DataFrame:
    """Return the loaded contact by every method side by side."""
    columns = {}
    for title, contact in (
        ("one disc, linear method", found.linear),
        ("one disc, law at every pin", found.single),
        ("all discs together", found.together),
    ):
        own = contact_summary(contact)
        pins = own["share of phases with so many pins in contact [-]"]
        columns[title] = {
            "torque [N·m]": f"{float(contact.torque[0].sum()):.4g}",
            "deflection over the phases [µm]": span(*own["deflection over the phases [µm]"]),
            "loaded zone [deg]": span(*own["loaded zone [deg]"]),
            "pins in contact on a disc, share of phases": ", ".join(f"{pin}: {at:.1%}" for pin, at in pins.items()),
            "largest pin force [N], at [deg]": f"{own['largest pin force [N]']:.1f}, "
            f"{own['largest pin force at [deg]']:.1f}",
            "peak pressure [MPa], at [deg]": f"{own['peak pressure [MPa]']:.0f}, {own['peak pressure at [deg]']:.1f}",
            "largest share of the torque on a disc [-]": f"{own['largest share of the torque on a disc [-]']:.3f}",
        }
    frame = pd.DataFrame(columns)
    frame.insert(0, "quantity", frame.index)
    return frame.reset_index(drop=True)


def pin_table(found: Assessment) -> pd.DataFrame:
    """Return gap, force and pressure of every pin that could carry, with a pin in the crank direction."""
    linear, single = found.linear, found.single
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


def answer(found: Assessment) -> tuple[str, ...]:
    """Return the answer in sentences."""
    single, pins = found.single, found.single.pins_in_contact
    return (
        f"Backlash {found.clearance.backlash / ARCMINUTE:.2f} arcmin, radial clearance "
        f"{found.clearance.radial / MICROMETRE:.1f} µm; the first pin touches at "
        f"{found.clearance.first_contact / DEGREE:.1f}°.",
        f"At {found.torque:g} N·m {span(pins.min(), pins.max())} pins of the more loaded disc carry, the most loaded "
        f"one {single.force.max():.0f} N at {single.most_loaded / DEGREE:.0f}°, and the largest pressure is "
        f"{single.pressure.max() / MEGAPASCAL:.0f} MPa at {single.most_pressed / DEGREE:.0f}°.",
    )
