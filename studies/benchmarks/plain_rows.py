"""All spring rows of a reducer with all their columns, plain and large: for proofs, and as what benchmarks beat."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.equivalent.condensation import bilateral_groups
from tolalloc.reducers.equivalent.interfaces import flank_terms, pin_contact, pin_terms, tooth_columns, wave_columns
from tolalloc.reducers.equivalent.springs import HARMONICS, Positions, SpringGroup, harmonic_waves
from tolalloc.reducers.reducer.design import Reducer


def spring_groups(
    reducer: Reducer, carrier_angle: Float[np.ndarray, " angle"], orders: tuple[int, ...] = HARMONICS
) -> list[SpringGroup]:
    """Return all spring groups with all their columns, pin contact last: plain and large, for proofs.

    Rows δ = a·q + b·ε, theory page (5) to (18), liu2020 as read there.
    """
    at = Positions(reducer, carrier_angle, orders)
    return [*bilateral_groups(at), dense_rows(at)]


def dense_rows(at: Positions) -> SpringGroup:
    """Return the pin contacts with all columns but the tilt as one plain spring group: large, for proofs only.

    Rows δ = a·q + b·ε of `pin_contact`, own derivation.
    """
    contact, reducer = pin_contact(at), at.reducer
    angles, discs, pins = contact.stiffness.shape
    stage, coordinates = reducer.cycloid_stage, at.coordinates
    displacement = np.zeros((angles, discs, pins, coordinates.count))
    columns: dict[str, Float[np.ndarray, "angle disc pin"]] = {}
    own_pin = np.concatenate([contact.by_pin, np.ones((angles, discs, 1, pins))], axis=2)
    for name, terms in pin_terms(reducer, at.orders).items():
        column = columns.setdefault(name, np.zeros((angles, discs, pins)))
        for entry, factor in terms:
            column[:, :, entry % pins] += factor * own_pin[:, :, entry // pins, entry % pins]
    columns |= dict.fromkeys(flank_terms(reducer), -np.abs(contact.by_disc[:, :, 2]))
    for disc in range(discs):
        first = coordinates.disc(disc)
        displacement[:, disc, :, first : first + 3] = np.swapaxes(contact.by_disc[:, disc], 1, 2)
        waves = harmonic_waves(contact.tooth_angle[:, disc], at.orders)
        for entry, name in enumerate(wave_columns(disc, at.orders)):
            column = columns.setdefault(name, np.zeros((angles, discs, pins)))
            column[:, disc] = contact.by_tooth[:, disc, entry // waves.shape[2]] * waves[..., entry % waves.shape[2]]
        for entry, name in enumerate(tooth_columns(reducer, disc)):
            column = columns.setdefault(name, np.zeros((angles, discs, pins)))
            met = contact.tooth[:, disc] == entry % stage.disc_teeth
            column[:, disc] = np.where(met, contact.by_tooth[:, disc, entry // stage.disc_teeth], 0.0)
    return SpringGroup(
        name="pin contact",
        stiffness_name="pin_contact",
        displacement=displacement.reshape(angles, discs * pins, coordinates.count),
        error=np.stack(list(columns.values()), axis=-1).reshape(angles, discs * pins, len(columns)),
        columns=tuple(columns),
        stiffness=contact.stiffness.reshape(angles, discs * pins),
        contact="unilateral",
    )
