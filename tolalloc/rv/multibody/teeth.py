"""Teeth and pins of a reducer as the loop over all contacts takes them."""

from __future__ import annotations

import numpy as np

from tolalloc.exceptions import InputError
from tolalloc.rv.cycloid.contact_stiffness import contact_stiffness
from tolalloc.rv.cycloid.solvers.contact_law import LAWS
from tolalloc.rv.cycloid.tooth_profile import ToothProfile
from tolalloc.rv.equivalent.kinematics import Positions
from tolalloc.rv.multibody.part_errors import PartErrors
from tolalloc.rv.multibody.solvers.pin_forces import Mesh
from tolalloc.rv.reducer.design import Reducer

_TABULATED = 1801  # angles of the contact's stiffness along a tooth


def mesh_of(reducer: Reducer, errors: PartErrors) -> Mesh:
    """Return the teeth and pins of a reducer whose pins deviate.

    Raises
    ------
    InputError
        A rotation modification.
    """
    stiffness, stage = reducer.stiffness, reducer.cycloid_stage
    if reducer.modification.rotation != 0.0:
        raise InputError.at(
            f"virtual prototype of {reducer.name}", "rotation modification", reducer.modification.rotation, "0"
        )
    ground = ToothProfile(stage=stage, modification=reducer.modification).ground
    angle = Positions(reducer, np.zeros(1)).pin_direction
    deviation = errors.pin[:, 0] + 1j * errors.pin[:, 1]
    contact = contact_stiffness(stage, stiffness, np.linspace(0.0, np.pi, _TABULATED))
    return Mesh(
        teeth=float(stage.disc_teeth),
        circle=ground.pin_circle_radius,
        pin=ground.pin_radius,
        eccentricity=stage.eccentricity,
        # Teeth stand so that each disc fits the pins where its own journal points.
        offset=-2 * np.pi * np.arange(reducer.disc_count) / reducer.disc_count / stage.disc_teeth,
        place=(stage.pin_circle_radius + deviation) * np.exp(1j * angle),
        angle=angle,
        radius=stage.pin_radius + errors.pin_radius,
        law=LAWS[stiffness.pin_contact_law],
        stiffness=contact.stiffness,
        log_length=contact.log_length,
    )
