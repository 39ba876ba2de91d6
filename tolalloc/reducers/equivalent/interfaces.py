"""Every interface of an RV reducer as a spring group with the sources that it declares.

Support of the sun gear, sun–planet meshes, all bearings, and the one-sided contact of disc teeth and housing pins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from tolalloc.drawings.zones import PHASE, ROTATION, TILT, Characteristic
from tolalloc.reducers.cycloid.loaded_contact import contact_stiffness
from tolalloc.reducers.cycloid.tooth_profile import Normals, normals
from tolalloc.reducers.equivalent.sources import ErrorSource, Nominal
from tolalloc.reducers.equivalent.springs import (
    AtAngles,
    Positions,
    SpringGroup,
    SpringRows,
    harmonic_columns,
    harmonic_waves,
    support,
    turned,
    vector_columns,
)
from tolalloc.reducers.reducer.design import Reducer


@dataclass(frozen=True, kw_only=True)
class Interface:
    """A spring group with what it declares: the sources whose columns move its rows first, or its clearances."""

    rows: Callable[[Positions], SpringGroup]
    sources: tuple[ErrorSource, ...]
    stiffness: str  # Field of `tolalloc.reducers.reducer.stiffness.Stiffness`
    symbol: str = ""  # Of a stiffness that measured units may tell
    called: str = ""  # In the names of outputs; nothing where the force in it is none of them
    is_mesh: bool = False  # Whether it carries along one direction; the others carry x and y


_STANDS_OFF = Characteristic("coaxiality", "assembly offset is toleranced as coaxiality")
_PIN_RADIUS = Nominal(said="its pin radius", of=lambda reducer: reducer.cycloid_stage.pin_radius)
_PIN_DIAMETER = Nominal(said="twice its pin radius", of=lambda reducer: 2 * reducer.cycloid_stage.pin_radius)
_ECCENTRIC = Characteristic("coaxiality", "the eccentricity of a gear is toleranced as its coaxiality")


def _fine(name: str, place: str, neglected: str, **other: Any) -> ErrorSource:
    """Return a source that a first study leaves out, as any table may."""
    return ErrorSource(name=name, place=place, neglected=neglected, fine=True, **other)


def clearance_source(element: str, *, neglected: str = "*.clearance", **other: Any) -> ErrorSource:
    """Return the deviations of the clearances of an interface's elements."""
    return _fine(f"{element}.clearance", element, neglected, **other)


def eccentricity_source(gear: str, **other: Any) -> ErrorSource:
    """Return how far the teeth of a gear of the first stage are off its axis."""
    name = f"{gear}.eccentricity"
    return ErrorSource(name=name, characteristic=_ECCENTRIC, shape="vector", place=gear, first_stage=True, **other)


def _tilt(part: str, **other: Any) -> ErrorSource:
    """Return the tilt of a part or of one of its features."""
    return _fine(f"{part}.tilt", part, "*.tilt", shape="vector", mirror="kept", characteristic=TILT, **other)


def sun_support(at: Positions) -> SpringGroup:
    """Return the two support springs of the sun gear, theory page equation (6).

    ``sun.assembly`` is (a_SX, a_SY), fixed in the housing [m]; δ = Xs − a_SX, Ys − a_SY [m], alike in every direction.

    References
    ----------
    liu2020, equations (2) to (12), whose energy's gradient it is.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> sun_support(Positions(load_reducer("rv20e_liu2020"), np.zeros(1))).error[0].tolist()
    [[-1.0, -0.0], [-0.0, -1.0]]
    """
    return support(at, at.coordinates.input, "sun support", "sun_support", "sun")


SUN_SUPPORT = Interface(
    rows=sun_support,
    stiffness="sun_support",
    symbol="K_s",
    sources=(
        ErrorSource(
            name="sun.assembly", fixed=True, characteristic=_STANDS_OFF, shape="vector", place="sun", first_stage=True
        ),
    ),
)


def gear_mesh(at: Positions) -> SpringGroup:
    """Return one spring per sun–planet mesh along its line of action, theory page equation (7).

    ``sun.eccentricity`` and ``sun.pitch`` turn with the sun, ``planet{i}.eccentricity`` and ``planet{i}.pitch`` with
    the crankshaft; ``mesh{i}.deviation`` is what the pair adds along its line of action (tooth thickness) [m].

    δ = n·(x_sun − x_planet) + r_b2·θp + errors along the line of action γ = P + π/2 − α [m], linear in both, involute
    teeth in mesh. A sun on a centre gear, whose rotation is not given, adds r_b1·θs.

    References
    ----------
    liu2020, equations (2) to (12); its (6) prints a_sp for r_b2. Pitch deviations are an own derivation.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> at = Positions(load_reducer("rv20e_liu2020"), np.zeros(1))
    >>> round(1e3 * float(gear_mesh(at).displacement[0, 0, at.coordinates.planet(0) + 2]), 2)  # r_b2 [mm/rad]
    18.32
    """
    reducer, coordinates, cranks = at.reducer, at.coordinates, at.reducer.crank_count
    rows, alpha = SpringRows(at, cranks), reducer.gears.pressure_angle
    for crank in range(cranks):
        position, planet = at.crank_position(crank), coordinates.planet(crank)
        line_of_action = position + np.pi / 2 - alpha
        normal = np.stack([np.cos(line_of_action), np.sin(line_of_action)], axis=-1)
        rows.displacement[:, crank, coordinates.input : coordinates.input + 2] = normal
        rows.displacement[:, crank, planet : planet + 2] = -normal
        rows.displacement[:, crank, planet + 2] = reducer.planet_base_radius
        if coordinates.input_turns:
            rows.displacement[:, crank, coordinates.input + 2] = reducer.sun_base_radius
        # Pitch deviations, counter-clockwise about their own gear, lie along the pitch circle, so cos α of them along
        # the line of action. The teeth in mesh stand at P_i seen from the sun's centre and opposite to it seen from the
        # planet's; there a planet's tooth that is ahead moves against the line of action, which compresses as the sun's
        # does.
        for part, turn, met, sign in (
            ("sun", at.sun_angle, position, 1.0),
            (f"planet{crank + 1}", at.crank_angle, position + np.pi, -1.0),
        ):
            eccentric = sign * np.einsum("ai,aij->aj", normal, turned(turn))
            waves = np.cos(alpha) * harmonic_waves(met - turn, at.orders)
            rows.add(crank, vector_columns(f"{part}.eccentricity"), eccentric)
            rows.add(crank, harmonic_columns(f"{part}.pitch", at.orders), waves)
        rows.add(crank, (f"mesh{crank + 1}.deviation",), np.ones(1))
    return rows.group("gear mesh", "gear_mesh", tuple(f"mesh{crank + 1}" for crank in range(cranks)))


GEAR_MESH = Interface(
    rows=gear_mesh,
    stiffness="gear_mesh",
    symbol="K_sp",
    called="mesh",
    is_mesh=True,
    sources=(
        eccentricity_source("sun"),
        ErrorSource(name="sun.pitch", shape="waves", place="sun.teeth", neglected="sun.pitch", first_stage=True),
        eccentricity_source("planet{i}", with_part=("crank{i}", "planet.eccentricity")),
        ErrorSource(
            name="planet{i}.pitch",
            shape="waves",
            place="planet{i}.teeth",
            neglected="planet*.pitch",
            first_stage=True,
            with_part=("crank{i}", "planet.pitch"),
        ),
        ErrorSource(
            name="mesh{i}.deviation",
            place="mesh{i}",
            neglected="mesh*",
            first_stage=True,
            with_part=("crank{i}", "mesh.deviation"),
        ),
        clearance_source("mesh{i}", neglected="mesh*", first_stage=True, with_part=("crank{i}", "mesh.clearance")),
    ),
)


def lever(radius: float, direction: AtAngles) -> Float[np.ndarray, "angle 2"]:
    """Return the movement, per radian of its part, of a point at a radius and direction [m/rad].

    r·(−sin, cos) of the direction, own derivation: the derivative of the point's place.
    """
    return radius * np.stack([-np.sin(direction), np.cos(direction)], axis=-1)


def _tilted(height: float, direction: AtAngles) -> Float[np.ndarray, "angle 2 2"]:
    """Return how far a point at a height moves, per tilt (x, y) of its part, which has turned [m/rad]."""
    return turned(direction) @ (height * np.array([[0.0, 1.0], [-1.0, 0.0]]))


def crank_disc(at: Positions) -> SpringGroup:
    """Return two springs per crank journal and disc bore, theory page equations (8), (9) and (29).

    Journals turn with the crankshaft, bores with the disc, that is with the carrier angle:
    ``crank{i}.journal{j}.eccentricity`` and ``disc{j}.bore{i}.position`` [m]. Angles [rad], tilts by equation (29):
    ``crank{i}.journal{j}.phase`` (the journal turned on its crankshaft), ``disc{j}.bores.rotation`` (the pattern of the
    bores against the teeth), ``crank{i}.tilt``, ``disc{j}.bore{i}.tilt`` and ``carrier.tilt``, the last fixed in the
    housing as the carrier's assembly error is. δ [m] is linear in errors and displacements.

    References
    ----------
    liu2020, equations (2) to (12), whose energy's gradient it is; the tilts are an own derivation.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> at = Positions(load_reducer("rv20e_liu2020"), np.zeros(1))
    >>> round(1e3 * float(crank_disc(at).displacement[0, 1, at.coordinates.planet(0) + 2]), 2)  # e·cos β [mm/rad]
    0.9
    """
    reducer, coordinates, eccentricity = at.reducer, at.coordinates, at.reducer.cycloid_stage.eccentricity
    pairs = [(crank, disc) for disc in range(reducer.disc_count) for crank in range(reducer.crank_count)]
    journals = tuple(f"crank{crank + 1}.journal{disc + 1}" for crank, disc in pairs)
    rows, upright = SpringRows(at, 2 * len(pairs)), np.zeros_like(at.carrier_angle)
    for number, (crank, disc) in enumerate(pairs):
        pair, plane, journal = slice(2 * number, 2 * number + 2), at.plane(disc), journals[number]
        planet, plate, bore = coordinates.planet(crank), coordinates.disc(disc), f"disc{disc + 1}.bore{crank + 1}"
        crank_turn = lever(eccentricity, at.disc_direction(disc))
        disc_turn = lever(reducer.crank_circle_radius, at.crank_position(crank))
        rows.displacement[:, pair, planet : planet + 2] = np.eye(2)
        rows.displacement[:, pair, planet + 2] = crank_turn
        rows.displacement[:, pair, plate : plate + 2] = -np.eye(2)
        rows.displacement[:, pair, plate + 2] = -disc_turn
        rows.add(pair, vector_columns(f"{journal}.eccentricity"), turned(at.crank_angle))
        rows.add(pair, vector_columns(f"{bore}.position"), -turned(at.carrier_angle))
        rows.add(pair, (f"{journal}.phase",), crank_turn[..., np.newaxis])
        rows.add(pair, (f"disc{disc + 1}.bores.rotation",), -disc_turn[..., np.newaxis])
        rows.add(pair, vector_columns(f"crank{crank + 1}.tilt"), _tilted(plane, at.crank_angle))
        rows.add(pair, vector_columns(f"{bore}.tilt"), -_tilted(plane, at.carrier_angle))
        rows.add(pair, vector_columns("carrier.tilt"), _tilted(plane, upright))
    places = tuple(f"{journal}.eccentricity" for journal in journals)
    return rows.group("crank–disc bearing", "crank_disc_bearing", journals, places=places)


CRANK_DISC = Interface(
    rows=crank_disc,
    stiffness="crank_disc_bearing",
    symbol="K_pd",
    called="crank–disc bearing",
    sources=(
        ErrorSource(name="crank{i}.journal{j}.eccentricity", shape="vector", place="crank{i}.journal{j}"),
        ErrorSource(name="disc{j}.bore{i}.position", shape="vector", place="disc{j}.bore{i}"),
        _fine("crank{i}.journal{j}.phase", "crank{i}.journal{j}", "*.phase", characteristic=PHASE),
        _fine("disc{j}.bores.rotation", "disc{j}.bores", "*.rotation", characteristic=ROTATION),
        _tilt("crank{i}"),
        _tilt("disc{j}.bore{i}"),
        _tilt("carrier", fixed=True),
        clearance_source("crank{i}.journal{j}"),
    ),
)


def crank_carrier(at: Positions) -> SpringGroup:
    """Return two springs per crankshaft bearing in the carrier, theory page equations (10) and (11).

    ``carrier.bore{i}.position`` turns with the carrier [m].

    δ = x_planet − x_carrier + a_sp·θca·(sin P, −cos P) − error [m], linear in both; at any carrier angle [rad].

    References
    ----------
    liu2020, equations (2) to (12), whose energy's gradient it is.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> group = crank_carrier(Positions(load_reducer("rv20e_liu2020"), np.zeros(1)))
    >>> round(1e3 * float(group.displacement[0, 1, -1]), 2)  # y of crank 1 per rotation of the carrier, −a_sp [mm/rad]
    -27.0
    """
    planets, carrier, cranks = at.coordinates.planet, at.coordinates.carrier, range(at.reducer.crank_count)
    bores = tuple(f"carrier.bore{crank + 1}" for crank in cranks)
    rows, places = SpringRows(at, 2 * len(bores)), tuple(f"{bore}.position" for bore in bores)
    for crank in cranks:
        pair, planet = slice(2 * crank, 2 * crank + 2), planets(crank)
        rows.displacement[:, pair, planet : planet + 2] = np.eye(2)
        rows.displacement[:, pair, carrier : carrier + 2] = -np.eye(2)
        rows.displacement[:, pair, carrier + 2] = -lever(at.reducer.crank_circle_radius, at.crank_position(crank))
        rows.add(pair, vector_columns(places[crank]), -turned(at.carrier_angle))
    return rows.group("crank–carrier bearing", "crank_carrier_bearing", bores, places=places)


CRANK_CARRIER = Interface(
    rows=crank_carrier,
    stiffness="crank_carrier_bearing",
    symbol="K_b",
    called="crank–carrier bearing",
    sources=(
        ErrorSource(name="carrier.bore{i}.position", shape="vector", place="carrier.bore{i}"),
        clearance_source("carrier.bore{i}"),
    ),
)


def carrier_support(at: Positions) -> SpringGroup:
    """Return the two springs of the carrier's bearing in the housing, theory page equation (12).

    ``carrier.assembly`` is (a_cx, a_cy), fixed in the housing [m]; δ = Xca − a_cx, Yca − a_cy [m], alike in every
    direction.

    References
    ----------
    liu2020, equations (2) to (12), whose energy's gradient it is.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> group = carrier_support(Positions(load_reducer("rv20e_liu2020"), np.zeros(1)))
    >>> group.columns, group.error[0].tolist()
    (('carrier.assembly.x', 'carrier.assembly.y'), [[-1.0, -0.0], [-0.0, -1.0]])
    """
    return support(at, at.coordinates.carrier, "carrier bearing", "carrier_bearing", "carrier")


CARRIER_SUPPORT = Interface(
    rows=carrier_support,
    stiffness="carrier_bearing",
    symbol="K_ca",
    called="carrier bearing",
    sources=(
        ErrorSource(name="carrier.assembly", fixed=True, characteristic=_STANDS_OFF, shape="vector", place="carrier"),
        clearance_source("carrier", fixed=True),
    ),
)


Terms = dict[str, list[tuple[int, float]]]
"""Column → the entries of a table that it moves, and by how much each [m/m or -]."""


@dataclass(frozen=True, kw_only=True)
class PinContact:
    """Contact of every disc with every pin at a batch of carrier angles; compression is minus the gap."""

    # Compression per displacement x, y and rotation of the disc [m/m, m/m, m/rad]
    by_disc: Float[np.ndarray, "angle disc 3 pin"]
    # Compression per radial and tangential deviation of the pin's place [m/m]
    by_pin: Float[np.ndarray, "angle disc 2 pin"]
    # Compression per pitch and run-out deviation of the tooth that the pin meets [m/m]
    by_tooth: Float[np.ndarray, "angle disc 2 pin"]
    # Compression by the form of flank and pin, where the reducer states one: a free or measured profile, roundness [m]
    by_form: Float[np.ndarray, "angle disc form pin"]
    tooth: Int[np.ndarray, "angle disc pin"]  # Which tooth that is, counted from 0 at the disc's zero direction [-]
    # θ_b, where on the disc the contact is, in the disc's own frame [rad]
    tooth_angle: Float[np.ndarray, "angle disc pin"]
    stiffness: Float[np.ndarray, "angle disc pin"]  # Contact stiffness of the pin at this tooth [N/m]
    # ln(λ/1 m) of the logarithmic law, `tolalloc.reducers.cycloid.loaded_contact.contact_stiffness` [-]
    log_length: Float[np.ndarray, "angle disc pin"]


def pin_contact(at: Positions) -> PinContact:
    """Return the contacts of all discs, theory page equations (13) to (18), and (83) where parts have a form.

    A tooth reaches from one root to the next. Its number follows from the contact's place on the disc, so it is tracked
    through the whole turn; at a root, where it changes, a pitch deviation has no effect.

    Compression δ = −g [m], g = n·(xd, yd) + r_d·θd·sin a + errors, linear; good to 0.3 µm on the working flanks for
    errors up to 10 µm, not above 15 µm or for modifications above 50 µm.

    References
    ----------
    liu2020 for the normals; the gap's errors are an own derivation, checked by differences of the exact geometry.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = pin_contact(Positions(load_reducer("rv20e_liu2020"), np.zeros(1)))
    >>> found.by_pin[0, 0, :, 0].round(9).tolist()  # at the root a pin that stands outward leaves a gap as wide
    [-1.0, -0.0]
    """
    stage, teeth = at.reducer.cycloid_stage, at.reducer.cycloid_stage.disc_teeth
    direction = np.stack([at.disc_direction(disc) for disc in range(at.reducer.disc_count)], axis=1)[..., np.newaxis]
    pin_angle = at.pin_direction - direction
    cosine, sine, into = np.cos(pin_angle), np.sin(pin_angle), normals(stage.shortening, pin_angle)
    normal = direction + np.arctan2(into.towards_tangent, into.towards_crank)
    # Contact point Q seen from the disc's centre, axes along and across the crank direction.
    along = stage.pin_circle_radius * cosine + stage.pin_radius * into.towards_crank - stage.eccentricity
    across = stage.pin_circle_radius * sine + stage.pin_radius * into.towards_tangent
    radius = np.hypot(along, across)
    # Unwrapped, so that a whole pin pitch of crank angle is a whole tooth; rounding must not change the tooth.
    turned = np.arctan2(across, along) - np.arctan2(sine, cosine) + at.pin_direction + direction / teeth
    contact, log_length = contact_stiffness(stage, at.reducer.stiffness, pin_angle)
    return PinContact(
        by_disc=np.stack([-np.cos(normal), -np.sin(normal), stage.disc_pitch_radius * into.lever], axis=2),
        by_pin=np.stack([-into.along_radius, -into.across_radius], axis=2),
        by_tooth=np.stack(
            [
                (into.towards_crank * across - into.towards_tangent * along) / radius,
                -(into.towards_crank * along + into.towards_tangent * across) / radius,
            ],
            axis=2,
        ),
        by_form=_by_form(at, pin_angle, into),
        tooth=np.floor(turned * teeth / (2 * np.pi) + 1e-9).astype(np.int64) % teeth,
        tooth_angle=turned,
        stiffness=contact,
        log_length=log_length,
    )


def _by_form(
    at: Positions, pin_angle: Float[np.ndarray, "angle disc pin"], into: Normals
) -> Float[np.ndarray, "angle disc form pin"]:
    """Return the compression by the form of flanks and pins, theory page equations (83) and (84), if they have one [m].

    Along a disc φ goes on clockwise, by a turn from each pin to the next; a pin is touched at κ from the inward radius.
    """
    form = at.reducer.form
    if form is None:
        return np.empty((*pin_angle.shape[:2], 0, pin_angle.shape[2]))
    around = pin_angle - 2 * np.pi * np.arange(pin_angle.shape[2])
    flanks = np.stack([form.of_flank(disc, around[:, disc]) for disc in range(around.shape[1])], axis=1)
    pins = form.of_pins(np.arctan2(into.across_radius, into.along_radius))
    return np.asarray((flanks + pins)[:, :, np.newaxis])


def pin_terms(reducer: Reducer, orders: tuple[int, ...]) -> Terms:
    """Return what each column adds to the pins: entries 0, zp, 2zp … are radial, tangential and radius deviations.

    Outward, counter-clockwise or material added is positive unless said otherwise [m]. For all pins alike:
    ``pin.diameter`` d_k, ``housing.groove.radius`` r_k (a larger groove lets the pin sink),
    ``modification.equidistant`` Δr_rp and ``modification.shift`` Δr_p. Along the ring: ``housing.runout`` radial,
    ``housing.pitch`` tangential. One pin k alone: ``each_pin.position.{k}`` with x radial and y tangential,
    ``each_pin.diameter.{k}``, ``each_pin.groove.{k}``.

    Signs are an own derivation, theory page equations (17) and (18): the effective radius error of a pin is
    d_k − r_k − Δr_rp.
    """
    pins = reducer.cycloid_stage.pin_count
    radial, tangential, radius = (range(first, first + pins) for first in (0, pins, 2 * pins))
    terms: Terms = {
        "pin.diameter": [(entry, 1.0) for entry in radius],
        "housing.groove.radius": [(entry, -1.0) for entry in radius],
        "modification.equidistant": [(entry, -1.0) for entry in radius],
        "modification.shift": [(entry, -1.0) for entry in radial],
    }
    waves = harmonic_waves(2 * np.pi * np.arange(pins) / pins, orders)
    for name, entries in (("housing.runout", radial), ("housing.pitch", tangential)):
        for column, wave in zip(harmonic_columns(name, orders), waves.T, strict=True):
            terms[column] = list(zip(entries, (float(value) for value in wave), strict=True))
    for pin in range(pins):
        terms[f"each_pin.diameter.{pin + 1}"] = [(radius[pin], 1.0)]
        terms[f"each_pin.groove.{pin + 1}"] = [(radius[pin], -1.0)]
        x, y = vector_columns(f"each_pin.position.{pin + 1}")
        terms |= {x: [(radial[pin], 1.0)], y: [(tangential[pin], 1.0)]}
    return terms


def flank_terms(reducer: Reducer) -> Terms:
    """Return the rotation amount of the modification, ``modification.rotation`` δ, as an arc at the pitch radius.

    Every flank is turned towards its tooth's middle by δ about the disc's centre, about which the normal of a pin has
    the lever r_d·S. So a gap on either flank opens by δ·r_d·|S| [m], theory page equations (17) and (35), own
    derivation, first order in δ [rad].

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> ((_, lever),) = flank_terms(load_reducer("rv20e_liu2020"))["modification.rotation"]
    >>> round(lever, 9)  # r_d = e·zc, 39 teeth at 0.9 mm [m]
    0.0351
    """
    return {"modification.rotation": [(0, reducer.cycloid_stage.disc_pitch_radius)]}


def wave_columns(disc: int, orders: tuple[int, ...]) -> tuple[str, ...]:
    """Return the harmonic deviations of a disc's teeth: ``disc{j}.pitch`` along the arc, ``disc{j}.runout`` outward."""
    return (*harmonic_columns(f"disc{disc + 1}.pitch", orders), *harmonic_columns(f"disc{disc + 1}.runout", orders))


def tooth_columns(reducer: Reducer, disc: int) -> tuple[str, ...]:
    """Return the deviations of single teeth t: ``disc{j}.each_tooth.pitch.{t}``, ``disc{j}.each_tooth.runout.{t}``."""
    teeth = range(1, reducer.cycloid_stage.disc_teeth + 1)
    return tuple(f"disc{disc + 1}.each_tooth.{kind}.{tooth}" for kind in ("pitch", "runout") for tooth in teeth)


def _of_tooth(kind: str) -> tuple[ErrorSource, ...]:
    """Return the deviations of a disc's teeth along the arc or outward: its waves, and single teeth."""
    place, single = "disc{j}.teeth", f"disc{{j}}.each_tooth.{kind}"
    return (
        ErrorSource(name=f"disc{{j}}.{kind}", shape="waves", teeth=True, place=place),
        _fine(single, place, "*.each_tooth.*", each="tooth", teeth=True),
    )


def _of_pin(kind: str, place: str, **other: Any) -> ErrorSource:
    """Return a deviation of every pin alone, fixed in the housing as they are."""
    return _fine(f"each_pin.{kind}", place, "each_pin.*", fixed=True, each="pin", **other)


PIN_SOURCES = (
    ErrorSource(name="pin.diameter", fixed=True, place="pins", nominal=_PIN_DIAMETER),
    ErrorSource(name="housing.groove.radius", place="housing.grooves", nominal=_PIN_RADIUS),
    ErrorSource(
        name="modification.equidistant",
        nominal=Nominal(
            said="its equidistant amount", of=lambda reducer: reducer.modification.equidistant, chosen=True
        ),
    ),
    ErrorSource(
        name="modification.shift",
        nominal=Nominal(said="its shift amount", of=lambda reducer: reducer.modification.shift, chosen=True),
    ),
    ErrorSource(name="modification.rotation", silent=True, characteristic=ROTATION, fine=True),
    ErrorSource(name="housing.runout", shape="waves", place="housing.pins"),
    ErrorSource(name="housing.pitch", shape="waves", place="housing.pins"),
    _of_pin("diameter", "pins", nominal=_PIN_DIAMETER),
    _of_pin("groove", "housing.grooves", nominal=_PIN_RADIUS),
    _of_pin("position", "housing.pins", shape="vector", mirror="kept"),
    *_of_tooth("pitch"),
    *_of_tooth("runout"),
    _tilt("disc{j}"),
)
"""What the contact of pins and teeth declares."""
