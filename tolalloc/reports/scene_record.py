"""A scene as JSON, its arrays to the last digit, read by Python and by a browser alike; and where its parts stand."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Complex, Float

from tolalloc.reducers.scene import Scene

VERSION = 1
"""Of the JSON; a picture refuses another one [-]."""
LEVELS = 255
"""Steps between the smallest and the largest number of a coarse block [-]."""


def block(values: Float[np.ndarray, "..."]) -> dict[str, Any]:
    """Return an array as an entry of JSON that loses nothing: little-endian doubles.

    Examples
    --------
    >>> block(np.array([1.0]))
    {'type': 'f8', 'shape': [1], 'data': 'AAAAAAAA8D8='}
    """
    content = np.ascontiguousarray(values, "<f8").tobytes()
    return {"type": "f8", "shape": list(values.shape), "data": b64encode(content).decode()}


def coarse_block(values: Float[np.ndarray, "..."]) -> dict[str, Any]:
    """Return an array in 255 equal steps from its smallest to its largest number: exact enough for the eye.

    A number that is not finite becomes 0; one above the smallest stays above it, so that what carries goes on carrying.
    """
    finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    low, high = (float(edge(finite)) if finite.size else 0.0 for edge in (np.min, np.max))
    step = (high - low) / LEVELS
    steps = np.maximum(np.rint((finite - low) / step), finite > low) if step else np.zeros(finite.shape)
    content = b64encode(steps.astype(np.uint8).tobytes()).decode()
    return {"type": "u1", "shape": list(values.shape), "low": low, "step": step, "data": content}


def values_of(entry: Mapping[str, Any]) -> Float[np.ndarray, "..."]:
    """Return the array of an entry.

    Examples
    --------
    >>> values_of(block(np.array([0.1, 2.0])))
    array([0.1, 2. ])
    """
    content, shape = b64decode(entry["data"]), tuple(entry["shape"])
    if entry["type"] == "u1":
        steps = np.frombuffer(content, np.uint8).reshape(shape)
        return np.asarray(entry["low"] + entry["step"] * steps)
    return np.asarray(np.frombuffer(content, "<f8").reshape(shape), float)


def scene_record(scene: Scene, coarse: bool = False) -> dict[str, Any]:
    """Return a scene as JSON knows it; a coarse one is small, 255 steps for all pins or parts."""
    found = {field.name: getattr(scene, field.name) for field in fields(scene)}
    for name in ("forward", "backward"):
        found[name] = {
            key: (coarse_block if coarse and value.ndim > 1 else block)(value)
            if isinstance(value, np.ndarray)
            else value
            for key, value in asdict(found[name]).items()
        }
    found["places"] = [asdict(place) | {"sources": list(place.sources)} for place in scene.places]
    return {"version": VERSION, **found, "carrier_angle": block(scene.carrier_angle)}


_TOOTH = ("exact", "normal")


@dataclass(frozen=True)
class Pose:
    """Everything at one carrier angle as complex numbers in the housing's plane, errors magnified [mm]."""

    record: Mapping[str, Any]  # The scene
    carrier_angle: float  # θc [rad]
    direction: str = "forward"  # Which equilibria are shown, ``forward`` or ``backward``

    def at(self, part: str) -> Float[np.ndarray, " number"]:
        """Return where the parts of a kind stand [rad]."""
        return np.asarray(np.array(self.record["start"][part]) + self.record["turns"][part] * self.carrier_angle)

    @cached_property
    def outline(self) -> Mapping[str, Any]:
        """Radii and counts."""
        found: Mapping[str, Any] = self.record["outline"]
        return found

    def state(self, name: str) -> Float[np.ndarray, "..."]:
        """Return a quantity of the equilibria, straight between their angles."""
        values = values_of(self.record[self.direction][name])
        place = (self.carrier_angle / (2 * np.pi)) % 1.0 * values.shape[0]
        low = int(place) % values.shape[0]
        share = place - int(place)
        return np.asarray(values[low] * (1 - share) + values[(low + 1) % values.shape[0]] * share)

    @cached_property
    def displacement(self) -> Float[np.ndarray, " coordinate"]:
        """All coordinates, magnified [mm, rad]."""
        lengths = self.record["magnification"] * self.state("displacement")
        return np.asarray(lengths)

    def shift(self, part: str, number: int = 0) -> complex:
        """Return how far a part is displaced, magnified [mm]."""
        first = self.record["coordinates"][part][number]
        return 1e3 * complex(self.displacement[first], self.displacement[first + 1])

    def rotation(self, part: str, number: int = 0) -> float:
        """Return how far a part is rotated, magnified [rad]."""
        return float(self.displacement[self.record["coordinates"][part][number] + 2])

    def offset(self, place: str, angle: float) -> complex:
        """Return how far the axis of a feature is off its place, magnified, its part turned by an angle [mm]."""
        own = self.record["offsets"].get(place, (0.0, 0.0))
        return complex(self.record["magnification"] * complex(*own) * np.exp(1j * angle))

    @cached_property
    def cranks(self) -> Complex[np.ndarray, " crank"]:
        """Nominal axes of the crankshafts, or of the output pins."""
        return np.asarray(self.outline["crank_circle_radius"] * np.exp(1j * self.at("carrier")))

    @cached_property
    def discs(self) -> Complex[np.ndarray, " disc"]:
        """Nominal centres of the discs."""
        return np.asarray(self.outline["eccentricity"] * np.exp(1j * self.at("crank")))

    def crank(self, crank: int) -> complex:
        """Return the axis of a crankshaft."""
        return complex(self.cranks[crank] + self.shift("planet", crank))

    def journal(self, crank: int, disc: int) -> complex:
        """Return the axis of a journal."""
        turned = 1j * self.rotation("planet", crank) * self.discs[disc]
        own = self.offset(f"crank{crank + 1}.journal{disc + 1}", float(self.at("crank")[0]))
        return complex(self.crank(crank) + self.discs[disc] + turned + own)

    def eccentric(self, disc: int) -> complex:
        """Return the axis of an eccentric of a single stage's shaft."""
        own = self.offset(f"shaft.journal{disc + 1}", float(self.at("crank")[0]))
        return complex(self.discs[disc] + self.shift("sun") + own)

    def bore(self, crank: int, disc: int) -> complex:
        """Return the axis of a disc's bore, or of its hole for an output pin."""
        turned = 1j * self.rotation("disc", disc) * self.cranks[crank]
        own = self.offset(f"disc{disc + 1}.bore{crank + 1}", self.carrier_angle)
        return complex(self.discs[disc] + self.cranks[crank] + self.shift("disc", disc) + turned + own)

    def carrier_bore(self, crank: int) -> complex:
        """Return the axis of a carrier's bore, or of an output pin."""
        turned = 1j * self.rotation("carrier") * self.cranks[crank]
        return complex(
            self.cranks[crank]
            + self.shift("carrier")
            + turned
            + self.offset(f"carrier.bore{crank + 1}", self.carrier_angle)
        )

    def ring(self, disc: int) -> complex:
        """Return how far the ring of pins stands off at a disc, where it gives."""
        return self.shift("ring", disc) if "ring" in self.record["coordinates"] else 0j

    @cached_property
    def pins(self) -> Complex[np.ndarray, " pin"]:
        """Centres of the pins where the ring stands still."""
        return np.asarray(self.outline["pin_circle_radius"] * np.exp(1j * self.at("pin")))

    def contact(self, disc: int) -> tuple[Complex[np.ndarray, " pin"], Complex[np.ndarray, " pin"]]:
        """Return where the pins touch a disc, and their normals into it.

        The common normal passes through the point about which disc and housing roll.
        """
        rolling = self.discs[disc] * self.outline["pin_count"]
        normal = (rolling - self.pins) / np.abs(rolling - self.pins)
        return self.pins + self.outline["pin_radius"] * normal, normal

    def teeth(self, disc: int) -> Complex[np.ndarray, " point"]:
        """Return the outline of a disc whose distance from every pin is the gap, magnified.

        Without modification and errors every tooth touches its pin; from there it is moved along its normal.
        """
        tooth, teeth = self.record["tooth"], self.outline["disc_teeth"]
        turn = np.exp(2j * np.pi * np.arange(teeth) / teeth)
        exact, normal = (np.multiply.outer(turn, np.asarray(tooth[name]) @ (1.0, 1j)).ravel() for name in _TOOTH)
        rotated, (point, _) = np.exp(1j * self.at("disc")[disc]), self.contact(disc)
        seen = np.angle((point - self.discs[disc]) / rotated)
        gap = 1e3 * self.record["magnification"] * self.state("gap")[disc]
        away = np.interp(np.angle(exact), seen, gap, period=2 * np.pi)
        return np.asarray((exact + away * normal) * rotated + self.discs[disc] + self.ring(disc))


def gear(teeth: int, module: float, pressure_angle: float) -> Complex[np.ndarray, " point"]:
    """Return the outline of an involute spur gear about the origin, its first tooth on the x axis [mm]."""
    pitch = module * teeth / 2
    base, root = pitch * np.cos(pressure_angle), pitch - 1.25 * module
    radius = np.array([root, *np.linspace(max(base, root), pitch + module, 6)])
    rolled = np.arccos(np.minimum(base / np.maximum(radius, base), 1.0))
    half = 0.98 * np.pi / (2 * teeth) + np.tan(pressure_angle) - pressure_angle - (np.tan(rolled) - rolled)
    flank = radius * np.exp(-1j * np.maximum(half, 0.0))
    tooth = np.concatenate([flank, flank.conj()[::-1]])
    return np.asarray(np.multiply.outer(np.exp(2j * np.pi * np.arange(teeth) / teeth), tooth).ravel())
