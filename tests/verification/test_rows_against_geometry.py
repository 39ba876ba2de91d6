"""Every coefficient of the spring rows, against central differences of the exact geometry.

Nothing here is linearised: parts turn by rotations, gears touch along the common tangent of their base circles, and the
gap of a pin is its distance to the disc's trochoid, whose nearest point is searched. Plane vectors are complex numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import newton
from scipy.spatial.transform import Rotation

from studies.benchmarks.plain_rows import spring_groups
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")  # a search that does not converge only warns
# A step moves the row that it moves most by STEP [m]. What then remains, relative to the column's largest coefficient,
# is the difference's own error: rounding of lengths of 0.05 m, some 3e-17/STEP = 3e-9, and the third derivative at the
# root of a tooth, where the path of the pin has a radius ρ of 0.18 mm, some (2·STEP/ρ)² = 1e-8 (a column of small
# coefficients takes twice the step). A wrong sign, direction or lever is wrong by far more.
STEP, TOLERANCE = 1e-8, 2e-8
ANGLES = 12  # so many that every tooth meets a pin on its flank, not only near a root, where its pitch hardly acts


def unit_vector(angle: np.ndarray | float) -> np.ndarray:
    return np.exp(1j * np.asarray(angle))


class DisplacedReducer:
    """A reducer at one carrier angle in many cases of displacements and errors; arrays are [case, 1] or [case, pin]."""

    def __init__(self, reducer: Reducer, carrier_angle: float, moved: np.ndarray, columns: tuple[str, ...]) -> None:
        self.reducer, self.stage, first = reducer, reducer.cycloid_stage, reducer.first_stage
        self.carrier_angle, self.crank_angle = carrier_angle, -self.stage.disc_teeth * carrier_angle
        # Seen from the carrier, sun and planets turn against each other by their numbers of teeth.
        self.sun_angle = carrier_angle + first.planet_teeth / first.sun_teeth * (carrier_angle - self.crank_angle)
        self.disc_direction = self.crank_angle + 2 * np.pi * np.arange(reducer.disc_count) / reducer.disc_count
        self.disc_centre = self.stage.eccentricity * unit_vector(self.disc_direction)
        crank_direction = carrier_angle + 2 * np.pi * np.arange(reducer.crank_count) / reducer.crank_count
        self.crank_centre = first.module * (first.sun_teeth + first.planet_teeth) / 2 * unit_vector(crank_direction)
        displacement, error = np.split(moved.T[..., np.newaxis], [moved.shape[1] - len(columns)])
        self.errors, self.nothing = dict(zip(columns, error, strict=True)), np.zeros((len(moved), 1))
        self.sun_moved = displacement[0] + 1j * displacement[1]
        # Planets with their crankshafts, then discs, then the carrier: three coordinates each.
        self.moved, self.turned = displacement[2::3] + 1j * displacement[3::3], displacement[4::3]

    def error(self, name: str) -> np.ndarray:
        return self.errors.get(name, self.nothing)

    def each(self, name: str, count: int) -> np.ndarray:
        return np.concatenate([self.error(name.format(number + 1)) for number in range(count)], axis=1)

    def harmonics(self, name: str, angle: np.ndarray) -> np.ndarray:
        names = {column: column.removeprefix(f"{name}.") for column in self.errors if column.startswith(f"{name}.")}
        waves = (self.errors[at] * getattr(np, wave[:3])(int(wave[3:]) * angle) for at, wave in names.items())
        return sum(waves, self.nothing)

    def carried(self, name: str, part_turned: float) -> np.ndarray:
        """An error in the plane that turns with its part."""
        return (self.error(f"{name}.x") + 1j * self.error(f"{name}.y")) * unit_vector(part_turned)

    def tilted_axis(self, name: str, disc: int, part_turned: float) -> np.ndarray:
        """Where an axis, tilted at half the height of all discs, passes a disc's middle plane."""
        tilt = self.carried(name, part_turned).ravel()
        height = (disc - (self.reducer.disc_count - 1) / 2) * self.stage.disc_spacing
        rotation = Rotation.from_rotvec(np.stack([tilt.real, tilt.imag, 0 * tilt.real], axis=1))
        return rotation.apply([0.0, 0.0, height]) @ np.array([[1], [1j], [0]])


def gear_mesh_rows(at: DisplacedReducer) -> Iterator[np.ndarray]:
    """Overlap of two involutes along the inner common tangent of their base circles."""
    first, alpha = at.reducer.first_stage, at.reducer.first_stage.pressure_angle
    sun_radius, planet_radius = first.module * first.sun_teeth / 2, first.module * first.planet_teeth / 2
    base_radii = np.cos(alpha) * (sun_radius + planet_radius)
    for crank in range(at.reducer.crank_count):
        planet, planet_turned = f"planet{crank + 1}", at.crank_angle + at.turned[crank]
        between = at.crank_centre[crank] + at.moved[crank] + at.carried(f"{planet}.eccentricity", planet_turned)
        between = between - at.sun_moved - at.carried("sun.eccentricity", at.sun_angle)
        distance, met = np.abs(between), np.angle(between)
        # A pitch deviation turns a flank about its gear by the deviation over the pitch radius.
        sun_flank = at.harmonics("sun.pitch", met - at.sun_angle) / sun_radius
        planet_flank = at.turned[crank] + at.harmonics(f"{planet}.pitch", met + np.pi - planet_turned) / planet_radius
        # The sun drives counter-clockwise, so the tangent leaves its base circle before the line of centres. Flanks
        # overlap where the strings unwound from both circles up to them are longer together than the tangent.
        leaves = np.angle(between / at.crank_centre[crank]) - np.arccos(base_radii / distance)
        unwound = np.cos(alpha) * (sun_radius * sun_flank + planet_radius * planet_flank) - base_radii * leaves
        touching = base_radii * (np.tan(alpha) - alpha)
        yield unwound + touching - np.sqrt(distance**2 - base_radii**2) + at.error(f"mesh{crank + 1}.deviation")


def crank_disc_rows(at: DisplacedReducer) -> Iterator[np.ndarray]:
    """Journal centre, as the crankshaft carries it, minus bore centre, as the disc carries it."""
    for disc, crank in np.ndindex(at.reducer.disc_count, at.reducer.crank_count):
        plate, shaft, bore = at.reducer.crank_count + disc, f"crank{crank + 1}", f"disc{disc + 1}.bore{crank + 1}"
        journal = at.disc_centre[disc] * unit_vector(at.error(f"{shaft}.journal{disc + 1}.phase"))
        journal = journal + at.carried(f"{shaft}.journal{disc + 1}.eccentricity", at.crank_angle)
        journal = journal + at.tilted_axis(f"{shaft}.tilt", disc, at.crank_angle)
        journal = at.crank_centre[crank] + at.moved[crank] + journal * unit_vector(at.turned[crank])
        hole = at.carried(f"{bore}.position", at.carrier_angle) + at.tilted_axis(f"{bore}.tilt", disc, at.carrier_angle)
        hole = hole + at.crank_centre[crank] * unit_vector(at.error(f"disc{disc + 1}.bores.rotation"))
        hole = at.disc_centre[disc] + at.moved[plate] + hole * unit_vector(at.turned[plate])
        yield journal + at.tilted_axis("carrier.tilt", disc, 0.0) - hole  # a tilted carrier takes its crankshafts along


def crank_carrier_rows(at: DisplacedReducer) -> Iterator[np.ndarray]:
    for crank in range(at.reducer.crank_count):
        error = at.carried(f"carrier.bore{crank + 1}.position", at.carrier_angle)
        bore = at.moved[-1] + (at.crank_centre[crank] + error) * unit_vector(at.turned[-1])
        yield at.crank_centre[crank] + at.moved[crank] - bore


def disc_profile(at: DisplacedReducer, disc: int, parameter: np.ndarray) -> np.ndarray:
    """Points of a disc's teeth in its own frame: parallel to the path of the pin when ground, then displaced.

    A rotation amount turns the two flanks of a tooth, which reaches from root to root, towards each other.
    """
    stage, name = at.stage, f"disc{disc + 1}"
    long = (stage.pin_circle_radius + at.error("modification.shift")) * unit_vector(parameter)
    short = stage.eccentricity * unit_vector(stage.pin_count * parameter)
    forward = 1j * (long - stage.pin_count * short)
    ground = long - short + (stage.pin_radius + at.error("modification.equidistant")) * 1j * forward / np.abs(forward)
    teeth = parameter * stage.disc_teeth / (2 * np.pi)
    ground = ground * unit_vector(np.where(teeth % 1 < 0.5, 1, -1) * at.error("modification.rotation"))
    outward, deviation = ground / np.abs(ground), 0.0
    tooth = np.floor(teeth).astype(int) % stage.disc_teeth
    for kind, direction in (("runout", outward), ("pitch", 1j * outward)):
        own = np.take_along_axis(at.each(f"{name}.each_tooth.{kind}.{{}}", stage.disc_teeth), tooth, axis=1)
        deviation = deviation + (own + at.harmonics(f"{name}.{kind}", np.angle(ground))) * direction
    return ground + deviation


def distance_to_profile(at: DisplacedReducer, disc: int, points: np.ndarray) -> np.ndarray:
    """Distance of pin centres, seen in the disc's frame, to its profile."""
    stage, around = at.stage, np.linspace(0, 2 * np.pi, 20000, endpoint=False)
    path = stage.pin_circle_radius * unit_vector(around) - stage.eccentricity * unit_vector(stage.pin_count * around)
    start = np.broadcast_to(around[np.abs(path - points[:1].T).argmin(axis=1)], points.shape)

    def off_perpendicular(parameter: np.ndarray) -> np.ndarray:
        # A chord will do for the tangent: at its foot the distance is stationary.
        chord = disc_profile(at, disc, parameter + 1e-6) - disc_profile(at, disc, parameter - 1e-6)
        return ((disc_profile(at, disc, parameter) - points) * chord.conj()).real / np.abs(chord)

    foot = newton(off_perpendicular, start, x1=start + 1e-6, tol=1e-9)
    return np.abs(disc_profile(at, disc, foot) - points)


def pin_contact_rows(at: DisplacedReducer) -> Iterator[np.ndarray]:
    """Minus the distance from each disc's profile to the surface of each pin."""
    stage, count = at.stage, at.stage.pin_count
    direction = 2 * np.pi * np.arange(count) / count
    outward = at.harmonics("housing.runout", direction) + at.each("each_pin.position.{}.x", count)
    along_arc = at.harmonics("housing.pitch", direction) + at.each("each_pin.position.{}.y", count)
    pin = (stage.pin_circle_radius + outward) * unit_vector(direction + along_arc / stage.pin_circle_radius)
    radius = stage.pin_radius + (at.error("pin.diameter") + at.each("each_pin.diameter.{}", count)) / 2
    groove = stage.pin_radius + at.error("housing.groove.radius") + at.each("each_pin.groove.{}", count)
    for disc in range(at.reducer.disc_count):
        plate = at.reducer.crank_count + disc
        # The disc has rolled in the ring of pins: its teeth have turned by −β_j/zc.
        turned_back = unit_vector(at.disc_direction[disc] / stage.disc_teeth - at.turned[plate])
        seen = (pin - at.disc_centre[disc] - at.moved[plate]) * turned_back
        # The disc presses the pin along the normal into its groove, away from the disc by the difference of radii.
        yield -(distance_to_profile(at, disc, seen) + (groove - radius) - radius)


EXACT_ROWS = {
    "sun support": lambda at: [at.sun_moved - at.carried("sun.assembly", 0.0)],
    "gear mesh": gear_mesh_rows,
    "crank–disc bearing": crank_disc_rows,
    "crank–carrier bearing": crank_carrier_rows,
    "carrier bearing": lambda at: [at.moved[-1] - at.carried("carrier.assembly", 0.0)],
    "pin contact": pin_contact_rows,
}


def exact_rows(name: str, at: DisplacedReducer) -> np.ndarray:
    """Compressions [case, row]; a vector gives two rows, x and y."""
    rows = ([row.real, row.imag] if np.iscomplexobj(row) else [row] for row in EXACT_ROWS[name](at))
    return np.concatenate([part for parts in rows for part in parts], axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("cranks", [2, 3])
def test_rows_are_the_derivatives_of_exact_geometry(cranks, generator):
    reducer = replace(load_reducer("rv20e_liu2020"), crank_count=cranks)
    carrier_angles = generator.uniform(0, 2 * np.pi, ANGLES)
    groups = spring_groups(reducer, carrier_angles)
    assert {group.name for group in groups} == EXACT_ROWS.keys()
    for group in groups:
        coordinates, columns = range(group.displacement.shape[2]), group.columns
        coefficients = np.concatenate([group.displacement, group.error], axis=2)
        largest = np.abs(coefficients).max(axis=(0, 1))
        assert largest[len(coordinates) :].all(), f"{group.name}: a column moves no row"
        scale = np.where(largest == 0, 1.0, largest)  # coordinates of other groups: these rows must not move
        for angle, expected in zip(carrier_angles, coefficients / scale, strict=True):
            cases = [DisplacedReducer(reducer, angle, sign * np.diag(STEP / scale), columns) for sign in (1, -1)]
            ahead, behind = (exact_rows(group.name, case) for case in cases)
            # Rows have no constant: undisturbed parts touch. What curvature adds is STEP²/ρ, 1e-12 m.
            assert np.abs(ahead + behind).max() < 1e-11, f"{group.name}: undisturbed parts do not touch"
            off = np.abs((ahead - behind).T / (2 * STEP) - expected).max(axis=0)
            assert off.max() < TOLERANCE, f"{group.name}: {[*coordinates, *columns][off.argmax()]} by {off.max():.1e}"
