"""Forces in every interface at the equilibria, and what engineers read off them: each output one small function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int

from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.answers import Equilibria
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.pins import PinContact, pin_contact
from tolalloc.reducers.equivalent.solvers.records import design_of
from tolalloc.reducers.equivalent.springs import harmonic_waves

SINGLE = ("gear_mesh",)
"""Interfaces that carry along one direction; the others carry x and y."""


@dataclass(frozen=True, kw_only=True)
class Forces:
    """Forces on the downstream part, positive where the interface is compressed; NaN where nothing converged."""

    pins: Float[np.ndarray, "sample angle disc pin"]  # Normal force between every pin and every disc [N]
    rows: Float[np.ndarray, "sample angle row"]  # Force of every bilateral spring [N]
    # Force x, y of every element with play; a mesh has x only [N]
    elements: Float[np.ndarray, "sample angle element 2"]
    rows_of_stiffness: dict[str, slice]  # As in `tolalloc.reducers.equivalent.columns.Columns` [-]

    def of(self, interface: str) -> Float[np.ndarray, "sample angle element"]:
        """Return the magnitude of the force in each element of an interface, named as in `Stiffness` [N]."""
        vector = self.vectors(interface)
        return np.asarray(np.hypot(vector[..., 0], vector[..., 1]))

    def vectors(self, interface: str) -> Float[np.ndarray, "sample angle element 2"]:
        """Return the force x, y in each element of an interface; a mesh has x only [N]."""
        own, bilateral = self.rows_of_stiffness[interface], self.rows.shape[2]
        if own.start >= bilateral:
            return self.elements[:, :, own.start - bilateral : own.stop - bilateral]
        rows = self.rows[:, :, own]
        if interface in SINGLE:
            return np.stack([rows, np.zeros_like(rows)], axis=-1)
        return rows.reshape(*rows.shape[:2], -1, 2)


def forces(equilibria: Equilibria) -> Forces:
    """Return the forces in all interfaces.

    Stiffness times compression of every row, theory page equation (5); pins by their law, equations (30) and (31),
    elements with play by equation (28).
    """
    from tolalloc.reducers.equivalent.solvers.turn import solve_forces

    tables, columns = equilibria.tables, equilibria.columns
    shape = equilibria.status.shape
    pins = np.empty((*shape, tables.contact_by_disc.shape[1], tables.contact_by_disc.shape[3]))
    rows = np.empty((*shape, tables.row_stiffness.shape[1]))
    elements = np.empty((*shape, tables.play_stiffness.shape[1], 2))
    solve_forces(
        tables,
        columns.layout,
        columns.map,
        design_of(equilibria.reducer),
        np.ascontiguousarray(equilibria.errors),
        equilibria.torque,
        equilibria.status,
        equilibria.retained,
        pins,
        rows,
        elements,
    )
    return Forces(pins=pins, rows=rows, elements=elements, rows_of_stiffness=columns.rows_of_stiffness)


_ROUNDING = 1e-9
"""Amplitude over the largest one below which an order is none [-]."""


@dataclass(frozen=True, kw_only=True)
class Orders:
    """Waves of the transmission error per output turn."""

    order: Int[np.ndarray, " order"]  # Waves per output turn [-]
    amplitude: Float[np.ndarray, "sample order"]  # Half the peak-to-peak of each wave, output side [rad]
    phase: Float[np.ndarray, "sample order"]  # Angle by which the wave, written as a cosine, leads [rad]

    def main(self, count: int, sample: int = 0) -> list[tuple[int, float, float]]:
        """Return the strongest orders of one sample with their amplitude and phase [rad], strongest first.

        Those that are rounding beside the strongest are left out.
        """
        own = self.amplitude[sample]
        strongest = [at for at in np.argsort(-own)[:count] if own[at] > _ROUNDING * own.max()]
        return [
            (int(self.order[at]), float(self.amplitude[sample, at]), float(self.phase[sample, at])) for at in strongest
        ]


def order_spectrum(transmission_error: Float[np.ndarray, "sample angle"]) -> Orders:
    """Return the orders 1, 2, … of curves on equally spaced angles of one output turn, the end point left out."""
    found = waves(transmission_error)
    return Orders(order=np.arange(1, found.shape[1] + 1), amplitude=np.abs(found), phase=np.angle(found))


def waves(curve: Float[np.ndarray, "row angle"]) -> Complex[np.ndarray, "row order"]:
    """Return the orders of curves as in `order_spectrum`: cosine amplitudes, minus i times sine amplitudes."""
    angles = curve.shape[1]
    return np.asarray(np.fft.rfft(curve, axis=1)[:, 1 : (angles + 1) // 2] * (2 / angles))


@dataclass(frozen=True, kw_only=True)
class Solved:
    """One solve over a turn, with what several outputs need."""

    equilibria: Equilibria  # Equilibria of all samples over one turn
    forces: Forces  # Forces in them

    @classmethod
    def of(cls, equilibria: Equilibria) -> Solved:
        """Return the equilibria with their forces."""
        return cls(equilibria=equilibria, forces=forces(equilibria))


def load_share(pins: Float[np.ndarray, "sample angle disc pin"]) -> Float[np.ndarray, "sample disc"]:
    """Return the share of all pin force that each disc carries, mean over the turn [-]."""
    total = pins.sum(axis=(1, 3))
    return np.asarray(total / total.sum(axis=1, keepdims=True))


def _mean(solved: Solved) -> Float[np.ndarray, " sample"]:
    return np.asarray(solved.equilibria.transmission_error.mean(axis=1) / ARCSECOND)


def _fewest(solved: Solved) -> Float[np.ndarray, " sample"]:
    return np.asarray(solved.equilibria.pins_in_contact.min(axis=1), float)


def _most(solved: Solved) -> Float[np.ndarray, " sample"]:
    return np.asarray(solved.equilibria.pins_in_contact.max(axis=1), float)


def _pin_force(solved: Solved) -> Float[np.ndarray, " sample"]:
    return np.asarray(solved.forces.pins.max(axis=(1, 2, 3)))


def _interface_force(interface: str) -> Callable[[Solved], Float[np.ndarray, " sample"]]:
    return lambda solved: np.asarray(solved.forces.of(interface).max(axis=(1, 2)))


def _largest_share(solved: Solved) -> Float[np.ndarray, " sample"]:
    return np.asarray(load_share(solved.forces.pins).max(axis=1))


OUTPUTS: dict[str, tuple[str, Callable[[Solved], Float[np.ndarray, " sample"]]]] = {
    "mean transmission error": ("arcsec", _mean),
    "pins in contact, least": ("-", _fewest),
    "pins in contact, most": ("-", _most),
    "largest pin force": ("N", _pin_force),
    "largest mesh force": ("N", _interface_force("gear_mesh")),
    "largest crank–disc bearing force": ("N", _interface_force("crank_disc_bearing")),
    "largest crank–carrier bearing force": ("N", _interface_force("crank_carrier_bearing")),
    "largest carrier bearing force": ("N", _interface_force("carrier_bearing")),
    "share of the pin force on the most loaded disc": ("-", _largest_share),
}
"""Every output of one solve with its unit, a number per sample; a new one is one function and one line here."""


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
