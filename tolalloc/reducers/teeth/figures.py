"""Figures of what a modification does to clearance and contact."""

from __future__ import annotations

import numpy as np

from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.assessment import Assessment
from tolalloc.reducers.cycloid.clearance import FLANK, linear_clearance
from tolalloc.reducers.cycloid.mesh import normals
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reports.figure import Figure, Series

METHODS = ("linear method", "law at every pin")
"""Both ways in which one disc is loaded, as legends call them."""


def profile_figure(profile: ToothProfile) -> Figure:
    """Draw one tooth, exact and with the modification magnified."""
    exact, angle = ToothProfile(stage=profile.stage), np.linspace(0.0, np.pi, 361)
    removed = linear_clearance(profile.stage, profile.modification, angle)
    places, apart = exact.points(angle), removed[:, np.newaxis] * exact.normals(angle)
    largest = max(float(np.abs(removed).max()), 1e-12)
    height = exact.tip_radius - exact.root_radius
    factor = max(float(f"{0.12 * height / largest:.0e}"), 1.0)
    middle = np.exp(1j * (np.pi / profile.stage.disc_teeth + np.pi / 2))  # the tooth's middle upright

    def upright(points: np.ndarray) -> tuple[list[float], list[float]]:
        own = (points[:, 0] + 1j * points[:, 1]) * middle / MILLIMETRE
        x, y = own.real.tolist(), own.imag.tolist()
        return x + [-value for value in x[::-1]], y + y[::-1]

    drawn = (("exact tooth", places), (f"modified, {factor:g} times magnified", places + factor * apart))
    # What is removed along the normal is drawn, not the slip of points along the flank, which changes nothing.
    return Figure(
        name="profile",
        title=f"One tooth of the disc, exact and modified ({factor:g} times magnified)",
        x_label="across the tooth [mm]",
        y_label="from the disc's centre [mm]",
        series=tuple(
            Series(label=label, kind="line", x=upright(points)[0], y=upright(points)[1]) for label, points in drawn
        ),
        equal=True,
    )


def clearance_figure(found: Assessment) -> Figure:
    """Draw clearance and deflection against the angle, and the zone where pins carry."""
    lever = normals(found.reducer.cycloid_stage.shortening, FLANK).lever
    angle = list(FLANK / DEGREE)
    low, high = found.single.zone.mean(axis=0) / DEGREE
    formula = [Series(label="Li Lixing's formula", kind="line", x=angle, y=list(found.clearance.formula / MICROMETRE))]
    if found.clearance.formula_error < 0.01 * MICROMETRE:  # the same line as the clearance
        formula = []
    return Figure(
        name="clearance",
        title="Clearance after the first contact, and what the load closes",
        x_label="angle of the pin from the crank direction [°]",
        y_label="clearance, deflection [µm]",
        series=(
            Series(label="clearance", kind="line", x=angle, y=list(found.clearance.after / MICROMETRE)),
            *formula,
            *(
                Series(
                    label=f"deflection, {name}",
                    kind="line",
                    x=angle,
                    y=list(lever * contact.deflection.mean() / MICROMETRE),
                )
                for name, contact in zip(METHODS, (found.linear, found.single), strict=True)
            ),
        ),
        vertical=((low, f"carrying from {low:.1f}°"), (high, f"to {high:.1f}°")),
    )


def force_figure(found: Assessment) -> Figure:
    """Draw the force of each pin."""
    angle = found.single.pin_angle[0, 0]
    order = [at for at in np.argsort(angle) if angle[at] > 0]
    return Figure(
        name="forces",
        title="Force of each pin, one of them in the crank direction",
        x_label="angle of the pin from the crank direction [°]",
        y_label="force [N]",
        series=tuple(
            Series(label=name, kind="points", x=list(angle[order] / DEGREE), y=list(contact.force[0, 0, order]))
            for name, contact in zip(METHODS, (found.linear, found.single), strict=True)
        ),
    )


def phase_figure(found: Assessment) -> Figure:
    """Draw how the number of pins in contact changes while one pin takes over from the next."""
    phase = list(found.single.phase / DEGREE)
    return Figure(
        name="pins_in_contact",
        title="Pins in contact on the more loaded disc over one pin pitch",
        x_label="angle from the crank direction to the next pin [°]",
        y_label="pins in contact [-]",
        series=tuple(
            Series(label=name, kind="points", x=phase, y=[int(count) for count in contact.pins_in_contact[:, 0]])
            for name, contact in zip(METHODS, (found.linear, found.single), strict=True)
        ),
    )
