"""The smallest gap at tip and root between the teeth and the pins of a built unit, all parts where they belong."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.rv.equivalent.kinematics import Positions
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.pins import PinContact, pin_contact
from tolalloc.rv.equivalent.springs import harmonic_waves


def radial_clearance(
    model: EquivalentModel, errors: Float[np.ndarray, "sample column"]
) -> Float[np.ndarray, " sample"]:
    """Return the smallest gap between all pins and teeth where the normal is radial, negative where they overlap [m].

    Minus the compression of the pin rows at no displacement, where a pin stands in the crank direction (root) or
    opposite to it (tip). What the rows feel there is radial: both modification amounts, pin diameter and groove radius
    in full, because the pin rests on the far side of its groove, the radial place of a pin and the run-out of a tooth.
    They do not feel what is tangential (pitch). What moves a disc (journals, bores, bearings, load) is left out by
    definition, and so is a disc's tilt.

    Within an output turn every pin is once at the tip and once at the root of every tooth of every disc. So the pin
    that stands out most meets the tooth that stands out most, and the rows of one pin give the gaps of all.
    """
    mapped, layout, orders = model.error_columns, model.error_columns.layout, model.orders
    values = np.asarray((mapped.matrix @ errors.T).T) + mapped.map.nominal
    pins = values[:, layout.pin : layout.wave].reshape(-1, 3, layout.pins)
    largest = []
    for disc in range(model.reducer.disc_count):
        contact = _at_tips_and_roots(model, disc)
        waves = harmonic_waves(contact.tooth_angle[:, disc, 0], orders)
        first, single = layout.wave + disc * layout.waves, layout.tooth + disc * 2 * layout.teeth
        along_ring = values[:, first : first + layout.waves].reshape(-1, 2, waves.shape[1])
        own = values[:, single : single + 2 * layout.teeth].reshape(-1, 2, layout.teeth)
        tooth = np.einsum("skw,pw->skp", along_ring, waves) + own[:, :, contact.tooth[:, disc, 0]]
        by_tooth, by_pin = contact.by_tooth[:, disc, :, 0].T, contact.by_pin[0, disc, :, 0]
        pin = by_pin[0] * pins[:, 0] + by_pin[1] * pins[:, 1] + pins[:, 2]
        largest.append(pin.max(axis=1) + (by_tooth * tooth).sum(axis=1).max(axis=1))
    return np.asarray(-np.max(largest, axis=0))


def _at_tips_and_roots(model: EquivalentModel, disc: int) -> PinContact:
    """Return the contacts at the angles of one output turn at which the first pin is tip or root of a disc's teeth."""
    teeth = model.reducer.cycloid_stage.disc_teeth
    half_turns = np.pi * np.arange(2 * teeth) + 2 * np.pi * disc / model.reducer.disc_count
    return pin_contact(Positions(model.reducer, half_turns / teeth, model.orders))
