"""Forces in every interface at the equilibria, and what engineers read off them: each output one small function.

Load along the width of tilted teeth, and which source makes which order of a unit's transmission error, are such too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import gcd

import numpy as np
from jaxtyping import Complex, Float, Integer, Real, UInt8

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.cycloid.line_contact import LineContact
from tolalloc.reducers.cycloid.loaded_contact import crowned_contact, peak_pressure
from tolalloc.reducers.cycloid.solvers import LAWS, LINEAR
from tolalloc.reducers.cycloid.tooth_profile import pin_angles
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.interfaces import pin_contact
from tolalloc.reducers.equivalent.model import Equilibria, EquivalentModel, Errors, OneUnit, Status
from tolalloc.reducers.equivalent.solvers.records import design_of
from tolalloc.reducers.equivalent.springs import AtAngles, Positions, harmonic_waves
from tolalloc.reducers.families.known import INTERFACES, family_of
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.form import PartForm
from tolalloc.reducers.reducer.housing import GIVES, RING

AtPins = Float[np.ndarray, "sample angle disc pin"]
"""A number of every pin on every disc, at every angle of every sample."""
MESHES = tuple(own.stiffness for own in INTERFACES if own.is_mesh)
_SINGLE = (*MESHES, *(f"{RING}{way}" for way in GIVES))
"""Interfaces that carry along one direction, named as in `Stiffness`; the others carry x and y."""
_ROUNDING = 1e-4
"""Amplitude over the largest one below which an order is not named [-]."""
_MULTIPLE, _OTHERS, _MOST = 936, 241, 20 * 936
"""Angles of a spectrum are a multiple of the first, a prime more for the curve that confirms it, and at most [-]."""
_CONFIRMED = 0.1
"""Difference of a wave on either, over its amplitude, up to which it is believed [-]."""
TORQUE, CLEARANCE, CURVATURE = "torque", "nominal clearance", "curvature of the contact law"
FORM = "form of flanks and pins"


@dataclass(frozen=True, kw_only=True)
class Forces:
    """Forces on the downstream part, positive where the interface is compressed; NaN where nothing converged."""

    pins: AtPins  # Normal force between every pin and every disc [N]
    rows: Float[np.ndarray, "sample angle row"]  # Force of every bilateral spring [N]
    # Force x, y of every element with play; a mesh has x only [N]
    elements: Float[np.ndarray, "sample angle element 2"]
    rows_of_stiffness: dict[str, slice]  # As in `tolalloc.reducers.equivalent.columns.Columns` [-]

    def of(self, interface: str) -> Float[np.ndarray, "sample angle element"]:
        """Return the magnitude of the force in each element of an interface, named as in `Stiffness` [N]."""
        vector = self.vectors(interface)
        return np.asarray(np.hypot(vector[..., 0], vector[..., 1]))

    def vectors(self, interface: str) -> Float[np.ndarray, "sample angle element 2"]:
        """Return the force x, y in each element of an interface; a mesh and a way of the ring have x only [N]."""
        own, bilateral = self.rows_of_stiffness[interface], self.rows.shape[2]
        if own.start >= bilateral:
            return self.elements[:, :, own.start - bilateral : own.stop - bilateral]
        rows = self.rows[:, :, own]
        if interface in _SINGLE:
            return np.stack([rows, np.zeros_like(rows)], axis=-1)
        return rows.reshape(*rows.shape[:2], -1, 2)


def forces(equilibria: Equilibria) -> Forces:
    """Return the forces in all interfaces, NaN where nothing converged.

    Stiffness times compression of every row, F = k·δ [N], theory page equation (5); pins by their law, equations (30)
    and (31), elements with play by equation (28).
    """
    from tolalloc.reducers.equivalent.solvers.turn import solve_forces

    tables, columns, errors = equilibria.tables, equilibria.columns, np.ascontiguousarray(equilibria.errors)
    shape = equilibria.status.shape
    pins = np.empty((*shape, tables.contact_by_disc.shape[1], tables.contact_by_disc.shape[3]))
    rows = np.empty((*shape, tables.row_stiffness.shape[1]))
    elements = np.empty((*shape, tables.play_stiffness.shape[1], 2))
    solve_forces(
        tables,
        (columns.layout, columns.map, design_of(equilibria.reducer), errors, equilibria.torque),
        *(equilibria.status, equilibria.retained, pins, rows, elements),
    )
    return Forces(pins=pins, rows=rows, elements=elements, rows_of_stiffness=columns.rows_of_stiffness)


@dataclass(frozen=True, kw_only=True)
class Orders:
    """Waves of the transmission error per output turn."""

    order: Float[np.ndarray, " order"]  # Waves per output turn, whole ones where the turn closes [-]
    amplitude: Float[np.ndarray, "sample order"]  # Half the peak-to-peak of each wave, output side [rad]
    phase: Float[np.ndarray, "sample order"]  # Angle by which the wave, written as a cosine, leads [rad]
    angles: int  # Angles that they are read from [-]

    def main(self, count: int) -> list[tuple[float, float, float]]:
        """Return the strongest orders of the first sample, with amplitude and phase [rad], strongest first."""
        own = self.amplitude[0]
        strongest = [at for at in np.argsort(-own)[:count] if own[at] > _ROUNDING * own.max()]
        return [(float(self.order[at]), float(own[at]), float(self.phase[0, at])) for at in strongest]


def _waves(
    curve: Float[np.ndarray, "row angle"], order: Float[np.ndarray, " order"], turns: int = 1
) -> Complex[np.ndarray, "row order"]:
    """Return orders of curves on equally spaced angles of turns that close, as `fitted_waves` would."""
    angles = curve.shape[1]
    return np.asarray(np.fft.fft(curve, axis=1)[:, np.rint(order * turns).astype(int) % angles] * (2 / angles))


def fitted_waves(
    angle: AtAngles, curve: Float[np.ndarray, "row angle"], order: Real[np.ndarray, " order"]
) -> Complex[np.ndarray, "row order"]:
    """Return orders of curves, cosine less i times sine amplitudes, by least squares: at any angles, of open turns too.

    min Σ(y − y₀ − Re Σ w·e^(inθ))², own derivation; every order that is strong must be among them.
    """
    turn = np.exp(1j * np.outer(angle, order))
    basis = np.hstack([np.ones((angle.size, 1)), turn.real, turn.imag])
    constant_and = np.linalg.lstsq(basis, curve.T, rcond=None)[0].T
    return np.asarray(constant_and[:, 1 : order.size + 1] - 1j * constant_and[:, order.size + 1 :])


def compensated_peak_to_peak(
    model: EquivalentModel, errors: Errors, torque: float, orders: Sequence[int]
) -> tuple[Float[np.ndarray, " sample"], UInt8[np.ndarray, " sample"]]:
    """Return the peak-to-peak that is left once orders of the output's turn are taken out, and the worst status [rad].

    max(y − Σ waves) − min(y − Σ waves) at the coarse angles of the search, and what finer angles add to the whole
    error, which may be more by up to 1 % of the whole than they add to what is left; own derivation. Each unit's own
    waves are taken out, as a controller does that has learnt them.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> from tolalloc.reducers.unit_file import load_unit
    >>> reducer = load_reducer("rv20e_liu2020")
    >>> model = EquivalentModel(reducer)
    >>> errors = load_unit("table4").errors(model.columns, reducer.modification.deviations)
    >>> [round(206264.8 * float(compensated_peak_to_peak(model, errors, -1.0, own)[0][0])) for own in ((), (1, 2))]
    [97, 74]
    """
    found, curve = model.extremes_and_curve(errors, torque)
    angle, known = 2 * np.pi * np.arange(curve.shape[1]) / curve.shape[1], np.nan_to_num(curve)
    wave = fitted_waves(angle, known, np.array(orders, float))
    left = known - (wave @ np.exp(1j * np.outer(np.array(orders, float), angle))).real
    span = np.ptp(left, axis=1) + np.maximum(found.peak_to_peak - np.ptp(known, axis=1), 0.0)
    return np.where(found.status == Status.CONVERGED, span, np.nan), found.status


def turn_orders(model: EquivalentModel, errors: OneUnit, torque: float, angles: int | None = None) -> Orders:
    """Return the orders of one unit [m, angles rad] that the angles hold; the amplitudes of others are 0.

    Waves beyond half of the angles fold back onto others, elsewhere for another number of angles: an order is told
    where two numbers show the same wave. Both are spread over as many output turns as bring all parts back, so that
    errors of sun, centre gear or pinion are one wave each where one turn cuts them. At least as many angles as given
    [-], else more than four for each wave that pins and teeth make; orders up to a third of them.

    Own derivation; amplitudes [rad], orders of the output turn, multiples of 1/turns.

    Examples
    --------
    >>> from tolalloc.reducers.equivalent.perfect import exact_unit
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> model = EquivalentModel(load_reducer("cd29"))
    >>> [(order, round(206264.8 * size, 2)) for order, size, _ in turn_orders(model, exact_unit(model), -1.0).main(2)]
    [(870.0, 0.23), (240.0, 0.11)]
    """
    turns, contact = model.reducer.closing_turns, max(model.reducer.contact_orders)
    first = _MULTIPLE * -(-min(angles or 4 * contact + 1, _MOST) // _MULTIPLE)
    order = np.arange(1, first * turns // 3) / turns
    found, other = (
        _waves(np.hstack([model.equilibria(errors, torque, own).transmission_error for own in parts]), order, turns)
        for parts in (_spread(count, turns) for count in (first, first + _OTHERS))
    )
    amplitude = np.where(np.abs(found - other) > _CONFIRMED * np.abs(found), 0.0, np.abs(found))
    return Orders(order=order, amplitude=amplitude, phase=np.angle(found), angles=first)


def _spread(count: int, turns: int) -> list[AtAngles]:
    """Return equally spaced angles of turns, other ones in every turn, in parts whose tables are small [rad]."""
    while gcd(count, turns) > 1:
        count += 1
    return np.array_split(2 * np.pi * turns * np.arange(count) / count, -(-count // _MULTIPLE))


@dataclass(frozen=True, kw_only=True)
class Solved:
    """One solve over a turn, with what several outputs need."""

    equilibria: Equilibria  # Equilibria of all samples over one turn
    forces: Forces  # Forces in them

    @classmethod
    def of(cls, equilibria: Equilibria) -> Solved:
        """Return the equilibria with their forces."""
        return cls(equilibria=equilibria, forces=forces(equilibria))

    @property
    def pins_in_contact(self) -> Integer[np.ndarray, "sample angle disc"]:
        """Number of pins of every disc that carry load [-]."""
        return np.asarray((self.forces.pins > 0.0).sum(axis=3))

    @cached_property
    def line_load(self) -> AtPins:
        """Largest line load of every pin and disc, the even one where nothing is tilted or crowned [N/m].

        F/b + C|γ|/2, own derivation; without tilt F/b; of crowned teeth that of `LineContact`.
        """
        columns, stage = self.equilibria.columns, self.equilibria.reducer.cycloid_stage
        tilts = columns.matrix[columns.layout.tilt : columns.layout.end]
        if not (stage.crowning or np.any(tilts @ self.equilibria.errors.T)):
            return np.asarray(self.forces.pins / stage.face_width)
        return line_contact(self.equilibria, self.forces).peak

    @property
    def pressure(self) -> AtPins:
        """Hertz's peak pressure of every pin and disc under that line load [Pa]."""
        return np.asarray(unit_pressure(self.equilibria) * np.sqrt(self.line_load))


def load_share(pins: AtPins) -> Float[np.ndarray, "sample disc"]:
    """Return the share of all pin force that each disc carries over the turn, Σ_disc F/Σ F, own derivation [-]."""
    total = pins.sum(axis=(1, 3))
    return np.asarray(total / total.sum(axis=1, keepdims=True))


def _interface_force(interface: str) -> Callable[[Solved], Float[np.ndarray, " sample"]]:
    return lambda solved: np.asarray(solved.forces.of(interface).max(axis=(1, 2)))


Quantity = tuple[str, Callable[[Solved], Float[np.ndarray, " sample"]]]
"""Unit of an output of one solve, and what gives it, a number per sample."""


def bearings_of(reducer: Reducer) -> dict[str, str]:
    """Return what bearings a reducer has besides pins and teeth, in words, and the interface as in `Stiffness`."""
    own = family_of(reducer).interfaces
    return {each.called: each.stiffness for each in own if each.called and not each.is_mesh}


def outputs_of(reducer: Reducer) -> dict[str, Quantity]:
    """Return every output of one solve, largest forces of those interfaces that the reducer has."""
    known = family_of(reducer).interfaces
    mesh = {own.called: own.stiffness for own in INTERFACES if own.is_mesh and own in known}
    return {
        "mean transmission error": ("arcsec", lambda own: own.equilibria.transmission_error.mean(axis=1) / ARCSECOND),
        "pins in contact on a disc, least": ("-", lambda own: own.pins_in_contact.min(axis=(1, 2)).astype(float)),
        "pins in contact on a disc, most": ("-", lambda own: own.pins_in_contact.max(axis=(1, 2)).astype(float)),
        "largest pin force": ("N", lambda own: own.forces.pins.max(axis=(1, 2, 3))),
        **{
            f"largest {called} force": ("N", _interface_force(name))
            for called, name in (mesh | bearings_of(reducer)).items()
        },
        "share of the pin force on the most loaded disc": ("-", lambda own: load_share(own.forces.pins).max(axis=1)),
    }


def radial_clearance(model: EquivalentModel, errors: Errors) -> Float[np.ndarray, " sample"]:
    """Return the smallest gap between all pins and teeth where the normal is radial, negative where they overlap [m].

    Minus the compression of the pin rows at no displacement, where a pin stands in the crank direction (root) or
    opposite to it (tip). What the rows feel there is radial: both modification amounts, pin diameter and groove radius
    in full, because the pin rests on the far side of its groove, the radial place of a pin and the run-out of a tooth.
    They do not feel what is tangential (pitch). What moves a disc (journals, bores, bearings, load) is left out by
    definition, and so is a disc's tilt.

    Within an output turn every pin is once at the tip and once at the root of every tooth of every disc. So the pin
    that stands out most meets the tooth that stands out most, and the rows of one pin give the gaps of all.

    Of errors without waves: −Δr_p + Δr_rp − d_k + r_k (own derivation) [m].
    """
    # One sample alone would be summed in another order than several.
    discs = _standing_out(model, np.resize(errors, (max(len(errors), 2), errors.shape[1])))
    found = -np.max([own.pin.max(axis=1) + own.tooth.max(axis=1) for own in discs], axis=0)
    return np.asarray(found[: len(errors)])


def radial_clearance_derivatives(model: EquivalentModel, errors: Errors) -> Errors:
    """Return the derivatives of `radial_clearance` by every error column [m/m, m/rad].

    Those of the gap between the pin and the tooth that stand out most, which is linear in the errors: own derivation.
    They hold while these stand out most.
    """
    discs, layout = _standing_out(model, errors), model.error_columns.layout
    disc = np.argmax([own.pin.max(axis=1) + own.tooth.max(axis=1) for own in discs], axis=0)
    by_value = np.zeros((len(errors), layout.end))
    for at, own in enumerate(discs):
        rows = np.flatnonzero(disc == at)
        pin, place = own.pin[rows].argmax(axis=1), own.tooth[rows].argmax(axis=1)
        for kind, factor in enumerate((*own.by_pin[:, pin], np.ones(rows.size))):
            by_value[rows, layout.pin + kind * layout.pins + pin] = -factor
        waves = own.by_tooth[:, place, np.newaxis] * own.waves[place]
        first, single = layout.wave + at * layout.waves, layout.tooth + at * 2 * layout.teeth
        last = first + 2 * own.waves.shape[1]
        by_value[rows, first:last] = -waves.transpose(1, 0, 2).reshape(rows.size, last - first)
        for kind in range(2):
            by_value[rows, single + kind * layout.teeth + own.number[place]] = -own.by_tooth[kind, place]
    return np.asarray((model.error_columns.matrix.T @ by_value.T).T)


@dataclass(frozen=True, kw_only=True)
class _StandingOut:
    """How far pins and teeth of a disc stand out where normals are radial, and by which values."""

    pin: Float[np.ndarray, "sample pin"]  # Every pin [m]
    tooth: Float[np.ndarray, "sample place"]  # Tip and root of every tooth [m]
    by_pin: Float[np.ndarray, "2 pin"]  # By the two coordinates of a pin [-]
    by_tooth: Float[np.ndarray, "2 place"]  # By the two deviations of a tooth [-]
    waves: Float[np.ndarray, "place wave"]  # Waves along the ring of teeth [-]
    number: Integer[np.ndarray, " place"]  # Position of the tooth [-]


def _standing_out(model: EquivalentModel, errors: Errors) -> list[_StandingOut]:
    """Return the same of every disc."""
    mapped, layout, orders = model.error_columns, model.error_columns.layout, model.orders
    values = np.asarray((mapped.matrix @ errors.T).T) + mapped.map.nominal
    pins = values[:, layout.pin : layout.wave].reshape(-1, 3, layout.pins)
    found, form = [], model.reducer.form or PartForm()
    round_pins = form.of_pins(np.zeros(layout.pins))
    for disc in range(model.reducer.disc_count):
        # Angles of one output turn at which the first pin is tip or root of the disc's teeth
        half_turns = np.pi * np.arange(2 * layout.teeth) + 2 * np.pi * disc / model.reducer.disc_count
        contact = pin_contact(Positions(model.reducer, half_turns / layout.teeth, orders))
        waves = harmonic_waves(contact.tooth_angle[:, disc, 0], orders)
        first, single = layout.wave + disc * layout.waves, layout.tooth + disc * 2 * layout.teeth
        along_ring = values[:, first : first + 2 * waves.shape[1]].reshape(-1, 2, waves.shape[1])
        own = values[:, single : single + 2 * layout.teeth].reshape(-1, 2, layout.teeth)
        tooth = np.einsum("skw,pw->skp", along_ring, waves) + own[:, :, contact.tooth[:, disc, 0]]
        flanks = form.of_flank(disc, np.pi * np.arange(contact.tooth.shape[0]))
        by_tooth, by_pin = contact.by_tooth[:, disc, :, 0].T, contact.by_pin[0, disc, :, 0]
        found.append(
            _StandingOut(
                pin=by_pin[0] * pins[:, 0] + by_pin[1] * pins[:, 1] + pins[:, 2] + round_pins,
                tooth=(by_tooth * tooth).sum(axis=1) + flanks,
                by_pin=np.repeat(by_pin[:, np.newaxis], layout.pins, axis=1),
                by_tooth=by_tooth,
                waves=waves,
                number=contact.tooth[:, disc, 0],
            )
        )
    return found


def line_contact(equilibria: Equilibria, forces: Forces) -> LineContact:
    """Return the contacts of all pins and discs, [sample, angle, disc, pin].

    A tilt γ moves a tooth at height z by z·(γy, −γx) in the housing's plane; the tilt turns with the disc.

    Slope γ = γ_y·n_x − γ_x·n_y [rad], theory page equation (31), own derivation, first order in the tilt.
    """
    tables, layout = equilibria.tables, equilibria.columns.layout
    tilt = (equilibria.columns.matrix[layout.tilt : layout.end] @ equilibria.errors.T).T
    x, y = (tilt.reshape(-1, 1, tables.contact_by_disc.shape[1], 2)[..., axis] for axis in (0, 1))
    cosine, sine = (tables.turn[:, part, np.newaxis] for part in (0, 1))
    along_x, along_y = (tables.contact_by_disc[:, :, axis] for axis in (0, 1))
    slope = (sine * x + cosine * y)[..., np.newaxis] * along_x - (cosine * x - sine * y)[..., np.newaxis] * along_y
    if equilibria.reducer.cycloid_stage.crowning:
        return crowned_contact(
            equilibria.reducer, angles_of_pins(equilibria.reducer, equilibria.carrier_angle), forces.pins, slope
        )
    return LineContact(
        force=forces.pins,
        stiffness=np.broadcast_to(tables.contact_stiffness.reshape(slope.shape[1:]), slope.shape),
        slope=slope,
        face_width=equilibria.reducer.cycloid_stage.face_width,
    )


def unit_pressure(equilibria: Equilibria) -> Float[np.ndarray, "angle disc pin"]:
    """Return Hertz's peak pressure under a line load of 1 N/m, √(E*/(πR)) per √(N/m), as `peak_pressure` [Pa].

    It grows with the root of the line load.
    """
    reducer, pin_angle = equilibria.reducer, angles_of_pins(equilibria.reducer, equilibria.carrier_angle)
    even = np.full_like(pin_angle, reducer.cycloid_stage.face_width)
    return peak_pressure(reducer.cycloid_stage, reducer.contact_modulus, pin_angle, even)


def angles_of_pins(reducer: Reducer, carrier_angle: AtAngles) -> Float[np.ndarray, "angle disc pin"]:
    """Return the angle of every pin from the crank direction of every disc [rad].

    φ_k − β_j, theory page equations (2) and (13), own derivation.
    """
    crank, apart = -reducer.cycloid_stage.disc_teeth * carrier_angle, 2.0 * np.pi / reducer.disc_count
    discs = range(reducer.disc_count)
    return np.stack([pin_angles(reducer.cycloid_stage, -(crank + apart * disc)) for disc in discs], axis=1)


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
        Unless given, the coarse angle of the model's search at which the disc's line load is largest [rad].
    positions
        Places along the width [-].

    References
    ----------
    Theory page equations (31) and (60), own derivation; Hertz's line contact for the pressure. Linear laws alone.
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


@dataclass(frozen=True, kw_only=True)
class Attribution:
    """A curve of transmission error as a sum over sources."""

    sources: tuple[str, ...]  # Names of the sources that contribute, the torque and the nominal clearances among them
    # What each adds to the transmission error at each angle; their sum is the curve [rad]
    contribution: Float[np.ndarray, "source angle"]
    order: Float[np.ndarray, " order"]  # Waves per output turn [-]
    # What each adds to the amplitude of each order: its wave's component along the whole wave, negative where it
    # cancels; the sum is the amplitude [rad]
    share: Float[np.ndarray, "source order"]
    amplitude: Float[np.ndarray, " order"]  # Amplitude of each order of the whole curve [rad]


def attribute(model: EquivalentModel, errors: OneUnit, torque: float, orders: Orders | None = None) -> Attribution:
    """Return what every source of one unit [m, angles rad] adds to its transmission error and to each order.

    Theory page, equation (32). All gaps, clearances and the torque scaled together scale the transmission error, as
    long as the contact law is linear, so Euler's theorem splits it [rad] into deviation times derivative. It holds for
    this unit: with other errors other pins carry, and a source's share changes. Under the logarithmic law the part that
    is not proportional is listed by itself. Angles and orders are those of `turn_orders` where its orders are given,
    else those of the model's search and all below half of them.

    TE = Σ ε·∂TE/∂ε + T·∂TE/∂T + Σ c·∂TE/∂c; exact for linear laws.

    References
    ----------
    Euler's theorem on homogeneous functions; own derivation for the waves.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> model = EquivalentModel(load_reducer("rv20e_liu2020"))
    >>> errors = np.zeros((1, len(model.columns)))
    >>> errors[0, model.columns.index("carrier.assembly.x")] = 5e-6
    >>> found = attribute(model, errors, -1.0)
    >>> found.sources, f"{206264.8 * found.amplitude.max():.2f}"  # largest order [arcsec]
    (('carrier.assembly', 'torque'), '1.23')
    """
    turns, count = (model.reducer.closing_turns, orders.angles) if orders else (1, model.search.coarse)
    order = orders.order[orders.amplitude[0] > 0] if orders else np.arange(1.0, (count + 1) // 2)
    made = [_contributions(model, errors, torque, own) for own in _spread(count, turns)]
    every = {name: np.concatenate([own[name] for own in made]) for name in made[0]}
    parts = {name: own for name, own in every.items() if own.any() or name not in (CLEARANCE, FORM)}
    contribution = np.array(list(parts.values()))
    parts_of_order = _waves(contribution, order, turns)
    total = parts_of_order.sum(axis=0)
    amplitude = np.abs(total)
    direction = np.divide(total, amplitude, out=np.zeros_like(total), where=amplitude > 0)
    return Attribution(
        sources=tuple(parts),
        contribution=contribution,
        order=order,
        share=np.real(parts_of_order * direction.conj()),
        amplitude=amplitude,
    )


def _contributions(model: EquivalentModel, errors: OneUnit, torque: float, angle: AtAngles) -> dict[str, AtAngles]:
    """Return what every source adds at the carrier angles [rad]."""
    curve, derivatives = model.rotation_derivatives(errors, torque, angle)
    parts: dict[str, Float[np.ndarray, " angle"]] = {}
    for at in np.flatnonzero(errors[0]):
        name = source_name(model.columns[at])
        parts[name] = parts.get(name, 0.0) + errors[0, at] * derivatives.by_error[:, at]
    parts |= {CLEARANCE: derivatives.by_nominal, FORM: derivatives.by_form, TORQUE: torque * derivatives.by_torque}
    if LAWS[model.reducer.stiffness.pin_contact_law] != LINEAR:
        parts[CURVATURE] = curve[0] - np.sum(list(parts.values()), axis=0)
    return parts
