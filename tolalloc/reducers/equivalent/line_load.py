"""Load along the width of teeth: even where disc and pin are parallel, heavier towards one end where they are not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reducers.cycloid.contact_stiffness import peak_pressure
from tolalloc.reducers.cycloid.solvers import LAWS, LINEAR
from tolalloc.reducers.equivalent.answers import Equilibria
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Forces, Solved


@dataclass(frozen=True, kw_only=True)
class LineContact:
    """Contacts of pins and teeth as springs side by side along the width of the tooth, theory page equation (31).

    What follows holds for the linear laws. Under the logarithmic one no disc tilts: `peak` is then the even load, and
    stiffness and `deformation` mean nothing.
    """

    force: Float[np.ndarray, "*contacts"]  # Normal force [N]
    stiffness: Float[np.ndarray, "*contacts"]  # Stiffness of the whole width, bending of the pin included [N/m]
    # By how much the tooth lies deeper in the pin per length along the width [rad]
    slope: Float[np.ndarray, "*contacts"]
    face_width: float  # Width b of the tooth [m]

    @property
    def peak(self) -> Float[np.ndarray, "*contacts"]:
        """Line load at the deeper end, F/b + C|γ|/2; where one end is lifted, √(2C|γ|F/b) [N/m]."""
        # Force at which the shallower end just touches.
        lifting = 0.5 * self.stiffness * self.face_width * np.abs(self.slope)
        deep = np.where(self.force < lifting, 2.0 * np.sqrt(lifting * self.force), self.force + lifting)
        return np.asarray(deep / self.face_width)

    def of(self, place: tuple[int, ...]) -> LineContact:
        """Return the contacts at a place, the first indices of the arrays [-]."""
        return replace(self, force=self.force[place], stiffness=self.stiffness[place], slope=self.slope[place])

    @property
    def deformation(self) -> Float[np.ndarray, "*contacts"]:
        """Compression at the deeper end, 0 without contact [m]."""
        return np.asarray(self.peak * self.face_width / self.stiffness)

    def line_load(self, position: Float[np.ndarray, " position"]) -> Float[np.ndarray, "*contacts position"]:
        """Return the line load along the width at places from −b/2 to b/2, 0 in the middle of the tooth [m], [N/m]."""
        slope = self.slope[..., np.newaxis]
        below_the_end = 0.5 * self.face_width * np.abs(slope) - slope * position
        rise = self.stiffness[..., np.newaxis] / self.face_width
        return np.asarray(np.maximum(self.peak[..., np.newaxis] - rise * below_the_end, 0.0))


def line_contact(equilibria: Equilibria, forces: Forces) -> LineContact:
    """Return the contacts of all pins and discs, [sample, angle, disc, pin].

    A tilt γ moves a tooth at height z by z·(γy, −γx) in the housing's plane; the tilt turns with the disc.
    """
    tables, layout = equilibria.tables, equilibria.columns.layout
    tilt = (equilibria.columns.matrix[layout.tilt : layout.end] @ equilibria.errors.T).T
    x, y = (tilt.reshape(-1, 1, tables.contact_by_disc.shape[1], 2)[..., axis] for axis in (0, 1))
    cosine, sine = (tables.turn[:, part, np.newaxis] for part in (0, 1))
    along_x, along_y = (tables.contact_by_disc[:, :, axis] for axis in (0, 1))
    slope = (sine * x + cosine * y)[..., np.newaxis] * along_x - (cosine * x - sine * y)[..., np.newaxis] * along_y
    return LineContact(
        force=forces.pins,
        stiffness=np.broadcast_to(tables.contact_stiffness.reshape(slope.shape[1:]), slope.shape),
        slope=slope,
        face_width=equilibria.reducer.cycloid_stage.face_width,
    )


def peak_line_load(equilibria: Equilibria, forces: Forces) -> Float[np.ndarray, "sample angle disc pin"]:
    """Return the largest line load of every pin and disc, the even one where no disc is tilted [N/m]."""
    layout = equilibria.columns.layout
    if not np.any(equilibria.columns.matrix[layout.tilt : layout.end] @ equilibria.errors.T):
        return np.asarray(forces.pins / equilibria.reducer.cycloid_stage.face_width)
    return line_contact(equilibria, forces).peak


def unit_pressure(equilibria: Equilibria) -> Float[np.ndarray, "angle disc pin"]:
    """Return Hertz's peak pressure under a line load of 1 N/m; it grows with the root of the line load [Pa]."""
    reducer, at = equilibria.reducer, Positions(equilibria.reducer, equilibria.carrier_angle)
    discs = [at.pin_direction - at.disc_direction(disc)[:, np.newaxis] for disc in range(reducer.disc_count)]
    pin_angle, stage = np.stack(discs, axis=1), reducer.cycloid_stage
    even = np.full_like(pin_angle, stage.face_width)
    return peak_pressure(stage, reducer.contact_modulus, pin_angle, even)


@dataclass(frozen=True, kw_only=True)
class ContactPattern:
    """Load of one disc on its pins at one carrier angle."""

    disc: int  # Number of the disc, 1 for the first [-]
    carrier_angle: float  # θc [rad]
    position: Float[np.ndarray, " position"]  # Places along the width, 0 in the middle of the tooth [m]
    force: Float[np.ndarray, " pin"]  # Normal force of every pin [N]
    deformation: Float[np.ndarray, " pin"]  # Its largest compression along the width, 0 without contact [m]
    line_load: Float[np.ndarray, "pin position"]  # Along the width of every pin [N/m]
    pressure: Float[np.ndarray, "pin position"]  # Hertz's peak pressure there [Pa]


def contact_pattern(
    model: EquivalentModel,
    errors: Float[np.ndarray, " column"],
    torque: float,
    disc: int = 1,
    carrier_angle: float | None = None,
    positions: int = 41,
) -> ContactPattern:
    """Return the load of one disc on its pins.

    Parameters
    ----------
    model, errors, torque
        The reducer; deviations of one unit and torque on the carrier, as it takes them [m, angles rad; N·m].
    disc
        Number of the disc, 1 for the first [-].
    carrier_angle
        Carrier angle; unless given, the coarse angle of the model's search at which the disc's line load is largest
        [rad].
    positions
        Places along the width [-].

    Raises
    ------
    InputError
        A disc that the reducer does not have, or a contact law that knows no load along the width.
    SolveError
        No equilibrium at one of the angles.
    """
    reducer, law = model.reducer, model.reducer.stiffness.pin_contact_law
    if not 1 <= disc <= reducer.disc_count:
        raise InputError.at(f"contact pattern of {reducer.name}", "disc", disc, f"1 to {reducer.disc_count}")
    if LAWS[law] != LINEAR:
        linear = " or ".join(name for name in LAWS if LAWS[name] == LINEAR)
        raise InputError.at(f"contact pattern of {reducer.name}", "law of the pin contact", law, linear)
    angles = None if carrier_angle is None else np.array([carrier_angle])
    solved = Solved.of(model.equilibria(errors[np.newaxis], torque, angles))
    failed = np.count_nonzero(solved.equilibria.status)
    if failed:
        raise SolveError(f"Contact pattern of {reducer.name}: no equilibrium at {failed} carrier angles.")
    contact = line_contact(solved.equilibria, solved.forces)
    at = int(np.argmax(contact.peak[0, :, disc - 1].max(axis=1)))
    own = contact.of((0, at, disc - 1))
    position = np.linspace(-0.5, 0.5, positions) * own.face_width
    line_load = own.line_load(position)
    return ContactPattern(
        disc=disc,
        carrier_angle=float(solved.equilibria.carrier_angle[at]),
        position=position,
        force=own.force,
        deformation=own.deformation,
        line_load=line_load,
        pressure=unit_pressure(solved.equilibria)[at, disc - 1, :, np.newaxis] * np.sqrt(line_load),
    )
