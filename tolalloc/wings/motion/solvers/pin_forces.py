"""Forces of pins on discs anywhere in the plane, by the exact distance of each pin from its tooth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolalloc.reducers.cycloid.solvers.pins import pin_force
from tolalloc.running.compiled import jit


class Mesh(NamedTuple):
    """Teeth and pins."""

    teeth: float  # Teeth of a disc [-]
    # Pin circle radius, pin radius and eccentricity of the grinding [m]
    circle: float
    pin: float
    eccentricity: float
    offset: np.ndarray  # Angle of the middle of a root on each disc [rad]
    place: np.ndarray  # x + iy of the pins in the housing, [pin] [m]
    angle: np.ndarray  # Their nominal directions, [pin] [rad]
    radius: np.ndarray  # Their radii, [pin] [m]
    law: int  # One of `tolalloc.reducers.cycloid.solvers.LAWS` [-]
    # What its contacts take at equally spaced angles of a pin from the crank direction, 0 to π [N/m, -]
    stiffness: np.ndarray
    log_length: np.ndarray
    # Form at equally spaced angles, outward positive: of every disc around it over φ, of every pin over κ from −π to π;
    # without an angle where the reducer has none, [disc, angle] and [pin, angle] [m]
    flank_form: np.ndarray
    pin_form: np.ndarray


@jit
def _depth(mesh, t, p):
    """Return how far the pin's centre p lies inside the path of the grinding pin's centre, the normal there, and t.

    The path is w(t) = R·exp(−it/z) − e·exp(−it(z+1)/z); Newton's method finds the t where p lies on its normal. Depth
    and normal do not feel a slip below a microradian, whose square they take. nan where none is found.
    """
    teeth, pins = mesh.teeth, mesh.teeth + 1.0
    for _ in range(15):
        small = np.exp(complex(0.0, -t / teeth))
        large = small * np.exp(complex(0.0, -t))
        by_circle, by_crank = mesh.circle * small, mesh.eccentricity * large
        off = p - (by_circle - by_crank)
        along = -1j / teeth * (by_circle - pins * by_crank)
        bend = -(by_circle - pins * pins * by_crank) / (teeth * teeth)
        miss = off.real * along.real + off.imag * along.imag
        length2 = along.real * along.real + along.imag * along.imag
        slope = off.real * bend.real + off.imag * bend.imag - length2
        if not slope < 0.0:
            break
        t -= miss / slope
        if abs(miss) < 1e-6 * -slope:
            normal = -1j * along / np.sqrt(length2)
            return off.real * normal.real + off.imag * normal.imag, normal, t
    return np.nan, complex(np.nan, np.nan), t


@jit
def _around(table, turns):
    """Return a table's value so many turns around, straight between its angles [m]."""
    place = (turns - np.floor(turns)) * table.size
    at = int(place) % table.size
    return table[at] + (place - np.floor(place)) * (table[(at + 1) % table.size] - table[at])


@jit
def pin_contacts(mesh, disc, q, contact):
    """Fill force [N], its derivative [N/m], compression [m], x and y of the normal into the disc [-] and its lever [m].

    ``q`` are x, y and turn of a disc; ``contact`` is [pin, 6]. The pins only push.

    Compression = depth + r_k − r_rp and the form of both where they touch, depth that of the pin's centre behind the
    path of the grinding pin's.

    References
    ----------
    Own derivation, as the exact distance of `tolalloc.reducers.cycloid.clearance.exact_clearance`.
    """
    centre = complex(q[0], q[1])
    crank = np.angle(centre)
    root, pitch = q[2] + mesh.offset[disc], 2.0 * np.pi / mesh.teeth
    last = mesh.stiffness.size - 1
    for k in range(mesh.place.size):
        around = mesh.angle[k] - crank
        t = around - 2.0 * np.pi * np.floor(around / (2.0 * np.pi) + 0.5)
        # Of the disc's roots the one that this pin would have ground.
        space = np.rint((mesh.angle[k] + t / mesh.teeth - root) / pitch)
        own = root + pitch * space
        frame, arm = np.exp(complex(0.0, own)), mesh.place[k] - centre
        depth, normal, touched = _depth(mesh, t, arm * np.conj(frame))
        normal *= frame
        compression = depth + mesh.radius[k] - mesh.pin
        if mesh.flank_form.shape[1] and compression == compression:
            inward = -normal * np.exp(complex(0.0, -mesh.angle[k]))
            compression += _around(mesh.flank_form[disc], (touched / (2.0 * np.pi) - space) / mesh.teeth)
            compression += _around(mesh.pin_form[k], np.angle(inward) / (2.0 * np.pi) + 0.5)
        part = abs(t) / np.pi * last
        at = min(int(part), last - 1)
        part -= at
        stiffness = (1.0 - part) * mesh.stiffness[at] + part * mesh.stiffness[at + 1]
        log_length = (1.0 - part) * mesh.log_length[at] + part * mesh.log_length[at + 1]
        contact[k, 0], contact[k, 1] = pin_force(mesh.law, stiffness, log_length, 0.0, compression)
        if compression != compression:
            contact[k, 0] = np.nan
        contact[k, 2] = compression
        contact[k, 3], contact[k, 4] = normal.real, normal.imag
        contact[k, 5] = arm.real * normal.imag - arm.imag * normal.real


@jit
def fill_forces(mesh, q, force, stiffness):
    """Fill force [N, N·m] and the negative of its derivative by place on discs at x, y, turn, [3·disc].

    The derivative leaves out how the normals turn, which is a few hundredths of the stiffness. A pin whose tooth was
    not found makes the force nan.
    """
    force[:], stiffness[:] = 0.0, 0.0
    contact = np.empty((mesh.place.size, 6))
    for disc in range(mesh.offset.size):
        first = 3 * disc
        pin_contacts(mesh, disc, q[first : first + 3], contact)
        for k in range(mesh.place.size):
            if contact[k, 2] <= 0.0:
                continue
            for i in range(3):
                force[first + i] += contact[k, 0] * contact[k, 3 + i]
                for j in range(3):
                    stiffness[first + i, first + j] += contact[k, 1] * contact[k, 3 + i] * contact[k, 3 + j]


@jit
def fill_pin_forces(mesh, q, force):
    """Fill the force of every pin [N], [time, disc, pin], on discs that pass places, [time, 3·disc]."""
    contact = np.empty((mesh.place.size, 6))
    for n in range(q.shape[0]):
        for disc in range(mesh.offset.size):
            pin_contacts(mesh, disc, q[n, 3 * disc : 3 * disc + 3], contact)
            force[n, disc] = contact[:, 0]
