"""The moving picture of a reducer in a report: a module of the page, and the same drawn still or as an animation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, UInt8
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Circle, Polygon
from matplotlib.transforms import Affine2D

from tolalloc.reports.figure import Figure, Series, chart
from tolalloc.reports.plots import drawn, save_png
from tolalloc.reports.scene_record import Pose, gear, values_of

_INK, _LINE, _ACCENT, _FORCE = "#1c2733", "#5b6876", "#d9822b", "#b00020"
_GROOVE, _HOUSING, _STEEL, _DISC, _GEAR, _PAPER = "#c8cbce", "#dadcde", "#b2b6ba", "#bed2e2", "#bbd9c7", "#ffffff"
_LONGEST = 0.3
"""Length of the arrow of the largest force over the radius of the pin circle [-]."""

_FRAMES_PER_SECOND = 12
_ANIMATION = {"save_all": True, "loop": 0, "transparency": 0, "blend": 1, "disposal": 0, "optimize": True}
"""How an animated PNG is saved: without end, each frame over the ones before."""

_EDGES = (("#1c2733", 3), ("#5b6876", 3), ("#b00020", 2))
"""Colours of lines, and into how many steps each goes over into a face."""

_FACES = ("#ffffff", "#dadcde", "#b2b6ba", "#bed2e2", "#bbd9c7", "#c8cbce", "#d5d7d9")


def mixed(colour: str, other: str, share: float) -> tuple[float, ...]:
    """Return red, green and blue of a colour with a share of another one [-]."""
    return tuple((1 - share) * own + share * more for own, more in zip(to_rgb(colour), to_rgb(other), strict=True))


def _points(values: Complex[np.ndarray, "*point"]) -> Float[np.ndarray, "*point 2"]:
    return np.stack([values.real, values.imag], axis=-1)


class _View:
    """Draws into one view, turned as a whole; places by their share."""

    def __init__(self, axes: Axes, shares: Mapping[str, float], turned: float):
        self.axes, self.shares = axes, shares
        self.transform = Affine2D().rotate(turned) + axes.transData

    def colour(self, place: str, colour: str) -> tuple[float, ...]:
        return mixed(colour, _ACCENT, min(max(self.shares.get(place, 0.0), 0.0), 1.0))

    def circle(self, centre: complex, radius: float, place: str, colour: str, **style: Any) -> None:
        given = {"facecolor": self.colour(place, colour), "edgecolor": _LINE, "linewidth": 0.7, **style}
        self.axes.add_patch(Circle((centre.real, centre.imag), radius, transform=self.transform, **given))

    def ring(self, centre: complex, radius: float, place: str, width: float = 1.4, **style: Any) -> None:
        wide = width * (1.0 + self.shares.get(place, 0.0))
        edge = self.colour(place, _LINE)
        self.circle(centre, radius, place, _PAPER, fill=False, edgecolor=edge, linewidth=wide, **style)

    def polygon(self, points: Complex[np.ndarray, " point"], face: Any, edge: Any, width: float) -> None:
        style = {"facecolor": face, "edgecolor": edge, "linewidth": width, "joinstyle": "round"}
        self.axes.add_patch(Polygon(_points(points), closed=True, transform=self.transform, **style))

    def lines(self, ends: Complex[np.ndarray, "line 2"], colour: str, width: float) -> None:
        style: dict[str, Any] = {"colors": colour, "linewidths": width, "transform": self.transform}
        self.axes.add_collection(LineCollection(list(_points(ends)), **style))

    def output(self, pose: Pose) -> None:
        """Draw where the output stands, turned further by the magnified transmission error."""
        outline = pose.outline
        end, inner = outline["housing_radius"], outline["pin_circle_radius"] + 1.6 * outline["pin_radius"]
        further = pose.record["magnification"] * float(pose.state("transmission_error"))
        triangle = np.array([0.995 * end, inner + 0.035j * end, inner - 0.035j * end])
        self.polygon(triangle * np.exp(1j * (pose.at("carrier")[0] + further)), _INK, _INK, 0.5)


def _draw_pins(pen: _View, pose: Pose, ring: complex) -> None:
    """Draw the ring, where it stands, with the pins in their grooves; the disc comes between the two."""
    outline = pose.outline
    pen.circle(ring, outline["housing_radius"], "housing.pins", _HOUSING)
    for place, colour, edge, factor, level in (
        ("housing.grooves", _GROOVE, "none", 1.45, 1.0),
        ("pins", _STEEL, _LINE, 1.0, 1.5),
    ):
        drawn = PatchCollection(
            [Circle((at.real, at.imag), factor * outline["pin_radius"]) for at in pose.pins + ring],
            facecolor=pen.colour(place, colour),
            edgecolor=edge,
            linewidth=0.7,
            transform=pen.transform,
        )
        drawn.set_zorder(level)
        pen.axes.add_collection(drawn)
    pen.circle(ring, outline["pin_circle_radius"], "", _PAPER, edgecolor="none")


def _draw_disc(pen: _View, pose: Pose, disc: int, largest: float) -> None:
    """Draw a disc with its cranks against the pins."""
    outline, number = pose.outline, disc + 1
    _draw_pins(pen, pose, pose.ring(disc))
    teeth = pose.teeth(disc)
    edge_colour = pen.colour(f"disc{number}.teeth", _INK)
    wide = 1.2 * (1.0 + pen.shares.get(f"disc{number}.teeth", 0.0))
    pen.polygon(teeth, pen.colour(f"disc{number}", _DISC), edge_colour, wide)
    pen.circle(complex(pose.discs[disc]), outline["disc_hole_radius"], "", _PAPER)
    centre = complex(pose.discs[disc] + pose.shift("disc", disc))
    if "output_pin_count" in outline:
        _draw_holes(pen, pose, disc)
    else:
        pen.ring(centre, outline["crank_circle_radius"], f"disc{number}.bores", 0.8, linestyle="--")
    for crank in range(outline["crank_count"]):
        bore, journal, axis = pose.bore(crank, disc), pose.journal(crank, disc), pose.crank(crank)
        pen.circle(bore, outline["bore_radius"], "", _PAPER, edgecolor="none")
        pen.ring(bore, outline["bore_radius"], f"disc{number}.bore{crank + 1}")
        for other in range(outline["disc_count"]):
            if other != disc:
                pen.circle(pose.journal(crank, other), outline["journal_radius"], "", _PAPER, fill=False, alpha=0.4)
        pen.circle(journal, outline["journal_radius"], f"crank{crank + 1}.journal{number}", "#d5d7d9")
        pen.circle(axis, 0.45 * outline["journal_radius"], f"crank{crank + 1}", _STEEL)
        pen.lines(np.array([[axis, journal]]), _INK, 1.4)
    _draw_forces(pen, pose, disc, largest)


def _draw_holes(pen: _View, pose: Pose, disc: int) -> None:
    """Draw the holes of a disc with the output pins in them, and the eccentric shaft in its bore."""
    outline, number = pose.outline, disc + 1
    for pin in range(outline["output_pin_count"]):
        pen.circle(pose.bore(pin, disc), outline["bore_radius"], "", _PAPER, edgecolor="none")
        pen.ring(pose.bore(pin, disc), outline["bore_radius"], f"disc{number}.holes")
        pen.circle(pose.carrier_bore(pin), outline["carrier_bore_radius"], "output.pins", _STEEL)
    shaft, eccentric = pose.shift("sun"), pose.eccentric(disc)
    pen.ring(complex(pose.discs[disc] + pose.shift("disc", disc)), outline["disc_hole_radius"], f"disc{number}.bore")
    pen.circle(eccentric, outline["journal_radius"], f"shaft.journal{number}", "#d5d7d9")
    pen.circle(shaft, outline["shaft_radius"], "shaft", _STEEL)
    pen.lines(np.array([[shaft, eccentric]]), _INK, 1.4)


def _draw_output(pen: _View, pose: Pose) -> None:
    """Draw the carrier with the output pins, and the input shaft."""
    outline = pose.outline
    pen.circle(pose.shift("carrier"), outline["carrier_radius"], "carrier", _HOUSING)
    for pin in range(outline["output_pin_count"]):
        pen.circle(pose.carrier_bore(pin), outline["carrier_bore_radius"], "output.pins", _STEEL)
    shaft, turned = pose.shift("sun"), np.exp(1j * float(pose.at("sun")[0]))
    pen.circle(shaft, outline["shaft_radius"], "shaft", _STEEL)
    pen.lines(np.array([[shaft + share * outline["shaft_radius"] * turned for share in (0.3, 0.9)]]), _INK, 1.4)


def _draw_forces(pen: _View, pose: Pose, disc: int, largest: float) -> None:
    """Draw the forces of the pins on a disc as arrows."""
    point, normal = pose.contact(disc)
    point = point + pose.ring(disc)
    length = _LONGEST * pose.outline["pin_circle_radius"] * pose.state("force")[disc] / largest
    shown = length > 0.004 * pose.outline["pin_circle_radius"]
    point, normal, length = point[shown], normal[shown], length[shown]
    tip, head = point + length * normal, np.minimum(0.35 * length, 0.028 * pose.outline["pin_circle_radius"])
    pen.lines(np.stack([point, tip], axis=-1), _FORCE, 1.2)
    barbs = np.stack([tip, tip - head * normal * (1 - 0.5j), tip - head * normal * (1 + 0.5j)], axis=-1)
    pen.axes.add_collection(
        PolyCollection(list(_points(barbs)), facecolor=_FORCE, edgecolor="none", transform=pen.transform)
    )


def _draw_first_stage(pen: _View, pose: Pose) -> None:
    """Draw carrier, planets and sun."""
    outline = pose.outline
    pen.circle(pose.shift("carrier"), outline["carrier_radius"], "carrier", _HOUSING)

    def draw_gear(name: str, teeth: int, centre: complex, angle: float) -> None:
        module = outline["module"]
        shape = gear(teeth, module, outline["pressure_angle"]) * np.exp(1j * angle) + centre
        web = max(module * teeth / 2 - 2 * module, 0.35 * module * teeth)
        pen.polygon(shape, pen.colour(f"{name}.teeth", _GEAR), _LINE, 0.7)
        pen.circle(centre, web, name, _GEAR)
        pen.lines(np.array([[centre + share * web * np.exp(1j * angle) for share in (0.65, 0.95)]]), _INK, 1.4)

    for crank in range(outline["crank_count"]):
        place = f"planet{crank + 1}"
        centre = pose.crank(crank) + pose.offset(place, float(pose.at("crank")[0]))
        draw_gear(place, outline["planet_teeth"], centre, float(pose.at("planet")[crank]))
        pen.ring(pose.carrier_bore(crank), outline["carrier_bore_radius"], f"carrier.bore{crank + 1}")
        pen.circle(pose.crank(crank), outline["shaft_radius"], f"crank{crank + 1}", _STEEL)
    sun = float(pose.at("sun")[0])
    draw_gear("sun", outline["sun_teeth"], pose.shift("sun") + pose.offset("sun", sun), sun)
    for crank, direction in enumerate(pose.at("carrier")):
        if pen.shares.get(f"mesh{crank + 1}", 0.0) > 0:
            at = complex(outline["module"] * outline["sun_teeth"] / 2 * np.exp(1j * direction))
            pen.ring(at, 1.1 * outline["module"], f"mesh{crank + 1}")


def _draw_centre_gear(pen: _View, pose: Pose) -> None:
    """Draw the centre gear on its hollow shaft and the input pinion beside it."""
    outline, centre, module = pose.outline, pose.shift("sun"), pose.outline["centre_module"]
    beside = complex(module * (outline["centre_teeth"] + outline["pinion_teeth"]) / 2)
    for name, axis, bore in (("centre", centre, outline["hollow_radius"]), ("pinion", beside, 2 * module)):
        teeth, angle = outline[f"{name}_teeth"], float(pose.at(name)[0])
        at = axis + pose.offset(name, angle - pose.record["start"][name][0])
        shape = gear(teeth, module, outline["centre_pressure_angle"]) * np.exp(1j * angle) + at
        pen.polygon(shape, pen.colour(name, _GEAR), _LINE, 0.7)
        pen.circle(axis, bore, "", _PAPER)
        mark = np.exp(1j * angle) * module * teeth / 2
        pen.lines(np.array([[at + share * mark for share in (0.7, 0.9)]]), _INK, 1.4)
    if pen.shares.get("centre.mesh", 0.0) > 0:
        pen.ring(complex(module * outline["centre_teeth"] / 2), 1.1 * module, "centre.mesh")


def _views(outline: Mapping[str, Any]) -> list[tuple[Callable[[_View, Pose], None], str]]:
    """Return what is drawn beside the discs, and what is said above it."""
    if "output_pin_count" in outline:
        return [(_draw_output, "output and input shaft")]
    centre = [(_draw_centre_gear, "centre gear and input pinion")] if "centre_teeth" in outline else []
    return [(_draw_first_stage, "carrier, planets and sun"), *centre]


def draw_still(
    record: Mapping[str, Any],
    shares: Mapping[str, float],
    carrier_angle: float = 0.0,
    *,
    title: str = "",
    turned: float = 0.0,
    discs: Sequence[int] = (),
    largest: float | None = None,
) -> Canvas:
    """Return the picture of a scene.

    Parameters
    ----------
    record, shares
        The scene, and how strongly each place is coloured [-].
    carrier_angle
        θc [rad].
    title
        What stands above it.
    turned
        Angle by which the eye sees all of it turned [rad].
    discs
        Numbers of the discs that are shown, from 0; all unless given [-].
    largest
        Force of the longest arrow, the largest of the turn unless given [N].
    """
    pose, shown = Pose(record, carrier_angle), (*discs,) or (*range(record["outline"]["disc_count"]),)
    largest = largest or max(1e-12, *(float(values_of(record[way]["force"]).max()) for way in ("forward", "backward")))
    others = _views(record["outline"])
    canvas = Canvas(figsize=(3.6 * (len(shown) + len(others)), 4.2), layout="constrained")
    views = np.atleast_1d(canvas.subplots(1, len(shown) + len(others)))
    reach = 1.02 * record["outline"]["housing_radius"]
    for axes in views:
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
        axes.axis("off")
    for disc, axes in zip(shown, views, strict=False):
        view = _View(axes, shares, turned)
        _draw_disc(view, pose, disc, largest)
        view.output(pose)
        axes.set_title(f"disc {disc + 1} on the pins", fontsize=10, color=_INK)
    for axes, (draw, what) in zip(views[len(shown) :], others, strict=True):
        view = _View(axes, shares, turned)
        view.circle(0j, record["outline"]["housing_radius"], "", _PAPER, fill=False, alpha=0.5)
        draw(view, pose)
        view.output(pose)
        axes.set_title(what, fontsize=10, color=_INK)
    stated = f"errors and gaps {record['magnification']:g} times larger, longest arrow {largest:,.0f} N"
    canvas.suptitle(f"{title}: {stated}" if title else stated, fontsize=10, color=_INK)
    return canvas


def animate(record: Mapping[str, Any], shares: Mapping[str, float], path: Path, frames: int, title: str) -> None:
    """Write an animated PNG of one turn of the cranks as the output sees it, after which the nominal picture closes.

    Seen from the carrier a turn of the cranks moves the ring of pins by one pin and the sun by whole teeth; for an eye
    in the housing nothing less than a whole output turn brings everything back. A frame holds what has changed since
    the one before, the rest of it is transparent.
    """
    from PIL import Image

    angles = 2 * np.pi / record["outline"]["pin_count"] * np.arange(frames) / frames
    largest = max(float(Pose(record, angle).state("force")[0].max()) for angle in angles)
    seen: dict[str, Any] = {"title": f"{title}, seen from its output", "discs": (0,), "largest": largest or None}
    pictures = [_pixels(draw_still(record, shares, angle, turned=-angle, **seen)) for angle in angles.tolist()]
    palette = Image.new("P", (1, 1))
    palette.putpalette(_palette())
    images = [Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    colours = [np.asarray(image) + 1 for image in images]
    written = []
    for at, colour in enumerate(colours):
        changed = colour if at == 0 else np.where(colour == colours[at - 1], 0, colour)
        image = Image.fromarray(changed.astype(np.uint8), "P")
        image.putpalette([0, 0, 0, *_palette()])
        written.append(image)
    written[0].save(path, format="PNG", append_images=written[1:], duration=1000 / _FRAMES_PER_SECOND, **_ANIMATION)


def _pixels(drawing: Canvas) -> UInt8[np.ndarray, "row column 3"]:
    """Return a drawing as red, green and blue."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(drawing)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _palette() -> list[int]:
    """Return the colours of the picture: its faces, and lines as they go over into them [0 to 255]."""
    colours = [mixed(face, face, 0.0) for face in _FACES]
    for edge, steps in _EDGES:
        colours += [mixed(face, edge, step / steps) for face in _FACES for step in range(1, steps)]
        colours.append(mixed(edge, edge, 0.0))
    return [round(255 * channel) for colour in colours for channel in colour]


@dataclass(frozen=True, kw_only=True)
class MovingPicture(Figure):
    """A reducer that moves in the page."""

    x_label: str = ""
    series: tuple[Series, ...] = ()
    record: Mapping[str, Any]  # The scene as `tolalloc.reports.scene_record.scene_record` says it
    shares: Mapping[str, float] = field(default_factory=dict)  # Place → how strongly it is coloured, from 0 to 1 [-]
    # Pictures of its PNG, one for a still one; more make one turn of the cranks as the output sees it, after which it
    # closes [-]
    pictures: int = 1


@chart.register
def _(figure: MovingPicture) -> dict[str, Any]:
    return {"title": figure.title, "scene": figure.record, "shares": figure.shares}


@drawn.register
def _(figure: MovingPicture) -> Canvas:
    return draw_still(figure.record, figure.shares, title=figure.title)


@save_png.register
def _(figure: MovingPicture, path: Path) -> None:
    if figure.pictures > 1:
        animate(figure.record, figure.shares, path, figure.pictures, figure.title)
    else:
        drawn(figure).savefig(path, dpi=130)


def strongest(shares: Mapping[str, float], place_by_source: Mapping[str, str]) -> dict[str, float]:
    """Return how strongly to colour each place: the sum of its sources' shares over the largest such sum [-].

    Examples
    --------
    >>> strongest({"disc1.pitch": 0.3, "disc1.runout": 0.1, "pin.diameter": 0.2}, {"disc1.pitch": "disc1.teeth",
    ...     "disc1.runout": "disc1.teeth", "pin.diameter": "pins"})
    {'disc1.teeth': 1.0, 'pins': 0.5}
    """
    sums: dict[str, float] = {}
    for source, share in shares.items():
        if source in place_by_source:
            place = place_by_source[source]
            sums[place] = sums.get(place, 0.0) + max(share, 0.0)
    most = max(sums.values(), default=0.0) or 1.0
    return {place: own / most for place, own in sums.items()}
