"""What one built unit does over one output turn: transmission error, orders, forces, lost motion, and their sources."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import SolveError
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, DEGREE
from tolalloc.reducers.cycloid.clearance import linear_model_warnings
from tolalloc.reducers.equivalent.answers import Equilibria, Extremes, Status, count_statuses
from tolalloc.reducers.equivalent.attribution import Attribution, attribute
from tolalloc.reducers.equivalent.friction_loop import FrictionLoop, friction_loop
from tolalloc.reducers.equivalent.hysteresis import (
    LOOP_ANGLES,
    LOOP_ASSUMPTION,
    LOST_MOTION,
    TURN_ANGLES,
    HysteresisLoop,
    both_directions,
    hysteresis_loop,
)
from tolalloc.reducers.equivalent.kinematics import HARMONICS
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import OUTPUTS, Orders, Solved, order_spectrum
from tolalloc.reducers.equivalent.own_loads import own_load_loop
from tolalloc.reducers.equivalent.perfect import exact_unit
from tolalloc.reducers.equivalent.preload import PRELOAD_ASSUMPTION, Preload, preload
from tolalloc.reducers.force_figure import force_figure
from tolalloc.reducers.friction_report import friction_section, friction_sentence, friction_summary
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.friction import friction_assumptions
from tolalloc.reducers.reducer.series import at_torque
from tolalloc.reducers.reducer.unit_file import BuiltUnit
from tolalloc.reducers.rigidity import against_catalogue, rated_pin_force, twist_shares
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.header import Header

if TYPE_CHECKING:
    import pandas as pd

    from tolalloc.reports.figure import Figure

_SHOWN = 8
"""Main orders that are named [-]."""
_DRAWN = 120
"""Orders that are drawn [-]."""


@dataclass(frozen=True, kw_only=True)
class TransmissionErrorAnswer(Answer):
    """One unit under one torque."""

    kind: ClassVar[str] = "transmission error"
    torque: float  # Torque on the carrier; negative resists the rotation [N·m]
    equilibria: Equilibria  # At equally spaced angles of one output turn
    extremes: Extremes  # Largest and smallest transmission error, refined
    preload: Preload  # What presses in this unit without torque
    loop: HysteresisLoop  # Hysteresis loop of this unit, of the perfect reducer, and of exact parts as modified
    # This unit's loop with every bearing under its own load; none where no bearing is given by its dimensions
    own_loads: HysteresisLoop | None
    friction: FrictionLoop | None  # This unit's with friction; none where the reducer's file does not say enough for it
    reversed_by: Float[np.ndarray, " angle"]  # What reversing the rotation adds to the curve [rad]
    attribution: Attribution | None  # Which source makes how much; none unless asked for
    equally_spaced: int  # Equally spaced angles of the search [-]
    cautions: tuple[str, ...]  # What the model itself must warn of

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"{self.header.model}, unit {self.header.name}, {self.torque:g} N·m on the carrier"

    @cached_property
    def orders(self) -> Orders:
        """Orders of the transmission error."""
        return order_spectrum(self.equilibria.transmission_error)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""
        found = self.summary
        strongest = ", ".join(f"{wave['order']} ({wave['amplitude_arcsec']:.3g}″)" for wave in found["main_orders"][:3])
        return (
            f"The transmission error spans {found['peak_to_peak_arcsec']:.2f}″ over one output turn, from "
            f"{found['smallest_arcsec']:.2f}″ at {found['smallest_at_deg']:.2f}° to {found['largest_arcsec']:.2f}″ at "
            f"{found['largest_at_deg']:.2f}°; "
            + (f"its strongest orders are {strongest}." if strongest else "it is flat."),
            *((friction_sentence(self.friction),) if self.friction else ()),
            *((stated,) if (stated := against_catalogue(self.equilibria.reducer, self.loop)[0]) else ()),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return (*self.preloaded, *self.cautions, *against_catalogue(self.equilibria.reducer, self.loop)[1])

    @cached_property
    def preloaded(self) -> tuple[str, ...]:
        """Say that the unit presses itself without torque, if it does so by more than the rated torque would."""
        found, rated = self.preload, rated_pin_force(self.equilibria.reducer)
        if not found.pin_force[0] > rated:
            return ()
        taken, ratio = float(found.friction_torque[0]), abs(self.equilibria.reducer.ratio)
        return (
            f"This unit is preloaded: without torque its pins press with up to {found.pin_force[0]:.0f} N, where the "
            f"rated torque makes {rated:.0f} N in a perfect reducer. It turns, but warm and worn early: the friction "
            f"of its pins alone takes up to {taken:.2g} N·m at the output, {taken / ratio:.2g} N·m at the motor.",
        )

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs, figures and tables."""
        shares: tuple[Section, ...] = ()
        if self.attribution is not None:
            words = (
                "Curve: peak-to-peak of what the source adds. Orders: component along the whole wave, minus cancels; "
                "columns sum to the amplitude."
            )
            table = (("attribution", self.attribution_table),)
            shares = (Section(heading="What each source adds", paragraphs=(words,), tables=table),)
        return (
            Section(
                heading="One output turn",
                figures=(self.curve_figure, self.order_figure, force_figure(self.equilibria)),
                tables=(("one turn", self.turn_table),),
                unfolded=True,
            ),
            Section(
                heading="Which part yields",
                paragraphs=("The twist of the perfect reducer under its rated torque, part by part.",),
                tables=(("twist", twist_shares(self.equilibria.reducer)),),
            ),
            *((friction_section(self.equilibria.reducer, self.friction),) if self.friction else ()),
            *shares,
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""
        extremes, solved, reversed_by = self.extremes, Solved.of(self.equilibria), self.reversed_by
        found = {
            "reducer": self.header.model,
            "unit": self.header.name,
            "torque_nm": self.torque,
            "peak_to_peak_arcsec": float(extremes.peak_to_peak[0] / ARCSECOND),
            "remaining_error_arcsec": float(extremes.remaining[0] / ARCSECOND),
            "largest_arcsec": float(extremes.largest[0] / ARCSECOND),
            "largest_at_deg": float(extremes.carrier_angle[0, 0] / DEGREE),
            "smallest_arcsec": float(extremes.smallest[0] / ARCSECOND),
            "smallest_at_deg": float(extremes.carrier_angle[0, 1] / DEGREE),
            "main_orders": [
                {"order": order, "amplitude_arcsec": amplitude / ARCSECOND, "phase_deg": phase / DEGREE}
                for order, amplitude, phase in self.orders.main(_SHOWN)
            ],
            "outputs": [
                {"name": name, "unit": unit, "value": float(value(solved)[0])}
                for name, (unit, value) in OUTPUTS.items()
            ],
            "pin_force_without_torque_n": float(self.preload.pin_force[0]),
            "largest_friction_torque_of_pins_without_load_nm": float(self.preload.friction_torque[0]),
            "lost_motion_arcmin": _pair(self.loop.lost_motion, ARCMINUTE),
            "backlash_arcmin": _pair(self.loop.backlash, ARCMINUTE),
            "torsional_stiffness_nm_per_arcmin": _pair(self.loop.torsional_stiffness, 1 / ARCMINUTE),
            "every_bearing_under_its_own_load": _own_loads(self.own_loads) if self.own_loads else None,
            "friction": friction_summary(self.friction) if self.friction else None,
            "reversal_arcsec": {
                "mean": float(reversed_by.mean() / ARCSECOND),
                "peak_to_peak": float(np.ptp(reversed_by) / ARCSECOND),
            },
            "angles": {"equally_spaced": self.equally_spaced, "solved_in_all": int(extremes.solves[0])},
            "largest_residual_of_largest_force": float(extremes.residual[0]),
            "statuses": dict(self.header.statuses),
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }
        if self.attribution is not None:
            found["attribution"] = _attributed(self.attribution)
        return found

    @cached_property
    def turn_table(self) -> pd.DataFrame:
        """The whole turn, one quantity per row."""
        import pandas as pd

        found = self.summary
        waves = (
            (
                f"order {wave['order']} of the output turn, amplitude [arcsec] and phase",
                f"{wave['amplitude_arcsec']:.2f} ∠ {wave['phase_deg']:.0f}°",
            )
            for wave in found["main_orders"]
        )
        loops = (
            (f"{label}, {whose.replace('_', ' ')} [{unit}]", "not found" if value is None else _short(value))
            for label, field, unit in (
                ("lost motion at ±3 % of rated torque", "lost_motion_arcmin", "arcmin"),
                ("backlash", "backlash_arcmin", "arcmin"),
                ("torsional stiffness", "torsional_stiffness_nm_per_arcmin", "N·m/arcmin"),
            )
            for whose, value in found[field].items()
        )
        own = found["every_bearing_under_its_own_load"]
        rows = [
            ("peak-to-peak over one output turn [arcsec]", f"{found['peak_to_peak_arcsec']:.2f}"),
            ("finer angles may add [arcsec]", f"{found['remaining_error_arcsec']:.3f}"),
            (f"largest, at {found['largest_at_deg']:.2f}° [arcsec]", f"{found['largest_arcsec']:.2f}"),
            (f"smallest, at {found['smallest_at_deg']:.2f}° [arcsec]", f"{found['smallest_arcsec']:.2f}"),
            *waves,
            *((f"{item['name']} [{item['unit']}]", _short(item["value"])) for item in found["outputs"]),
            ("largest pin force without torque [N]", _short(found["pin_force_without_torque_n"])),
            (
                "largest friction torque of the pins without load, at the output [N·m]",
                _short(found["largest_friction_torque_of_pins_without_load_nm"]),
            ),
            *loops,
            *(
                (f"{name}, every bearing under its own load [{unit}]", _short(own[field]))
                for name, field, unit in (
                    ("lost motion at ±3 % of rated torque", "lost_motion_arcmin", "arcmin"),
                    ("torsional stiffness", "torsional_stiffness_nm_per_arcmin", "N·m/arcmin"),
                )
                if own
            ),
            ("reversing the direction adds, mean [arcsec]", f"{found['reversal_arcsec']['mean']:.2f}"),
            ("reversing the direction adds, peak-to-peak [arcsec]", f"{found['reversal_arcsec']['peak_to_peak']:.2f}"),
            *((f"angles: {outcome} [-]", str(count)) for outcome, count in found["statuses"].items() if count),
            ("largest unbalanced force over largest force [-]", f"{found['largest_residual_of_largest_force']:.1e}"),
        ]
        return pd.DataFrame(rows, columns=["quantity", "value"])

    @cached_property
    def attribution_table(self) -> pd.DataFrame:
        """What each source adds to the curve and to the main orders, and what they make together."""
        import pandas as pd

        found = self.summary["attribution"]
        names = [f"order {order} [arcsec]" for order in found["orders"]]
        rows = [
            {
                "source": item["source"],
                "curve [arcsec]": item["peak_to_peak_arcsec"],
                **dict(zip(names, item["share_arcsec"], strict=True)),
            }
            for item in found["sources"]
        ]
        together = {"source": "together", **dict(zip(names, found["amplitude_arcsec"], strict=True))}
        return pd.DataFrame([*rows, together])

    @cached_property
    def curve_figure(self) -> Figure:
        """The curve and its refined extremes."""
        from tolalloc.reports.figure import Figure, Series

        found, extremes = self.equilibria, self.extremes
        return Figure(
            name="transmission_error",
            title=f"Transmission error over one output turn: {extremes.peak_to_peak[0] / ARCSECOND:.1f}″ peak-to-peak",
            x_label="carrier angle [°]",
            y_label="transmission error [arcsec]",
            series=(
                Series(
                    label=f"{found.carrier_angle.size} equally spaced angles",
                    kind="line",
                    x=list(found.carrier_angle / DEGREE),
                    y=list(found.transmission_error[0] / ARCSECOND),
                ),
                Series(
                    label="extremes, refined",
                    kind="points",
                    x=[float(angle) for angle in extremes.carrier_angle[0] / DEGREE],
                    y=[float(extremes.largest[0] / ARCSECOND), float(extremes.smallest[0] / ARCSECOND)],
                ),
            ),
        )

    @cached_property
    def order_figure(self) -> Figure:
        """The amplitude of the first orders."""
        from tolalloc.reports.figure import Figure, Series

        shown = slice(0, _DRAWN)
        amplitude = self.orders.amplitude[0, shown] / ARCSECOND
        return Figure(
            name="orders",
            title="Orders of the transmission error",
            x_label="order of the output turn [-]",
            y_label="amplitude [arcsec]",
            series=(Series(label="amplitude", kind="stems", x=list(self.orders.order[shown]), y=list(amplitude)),),
        )


def transmission_error(
    reducer: Reducer, unit: BuiltUnit, torque: float, *, attributed: bool = False
) -> TransmissionErrorAnswer:
    """Return what a unit does over one output turn.

    The torque is that on the carrier, negative resists [N·m]; attributed says which source makes how much of each
    order.

    Raises
    ------
    SolveError
        An angle without equilibrium.
    """
    model = EquivalentModel(at_torque(reducer, torque), orders=unit.orders or HARMONICS)
    errors = unit.errors(model.columns, reducer.modification.deviations)
    equilibria, extremes = model.equilibria(errors, torque), model.exact_extremes(errors, torque)
    worst = Status(max(extremes.status[0], equilibria.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"unit {unit.name}: no transmission error can be given, at some angle: {worst.sentence}.")
    forward, backward = both_directions(model, errors, torque)
    loops = np.concatenate([errors, np.zeros_like(errors), exact_unit(model)])
    friction = None if reducer.friction_dimensions.unknown else friction_loop(model, errors, TURN_ANGLES)
    return TransmissionErrorAnswer(
        header=Header(
            name=unit.name,
            model=reducer.name,
            conditions={"torque on the carrier [N·m]": torque},
            assumptions=(
                *reducer.assumptions,
                *unit.assumptions,
                LOOP_ASSUMPTION,
                PRELOAD_ASSUMPTION,
                *friction_assumptions(reducer.friction, reducer.friction_dimensions),
            ),
            statuses=dict(count_statuses(equilibria.status)),
        ),
        torque=torque,
        equilibria=equilibria,
        extremes=extremes,
        preload=preload(model, errors),
        loop=hysteresis_loop(model, loops, LOOP_ANGLES),
        own_loads=own_load_loop(model, errors, TURN_ANGLES, (LOST_MOTION, 1.0)) if reducer.parts else None,
        friction=friction,
        reversed_by=(backward - forward)[0],
        attribution=attribute(model, errors, torque) if attributed else None,
        equally_spaced=model.search.coarse,
        cautions=tuple(linear_model_warnings(reducer.cycloid_stage, reducer.modification)),
    )


def _pair(values: Float[np.ndarray, " sample"], unit_of_measurement: float) -> dict[str, float | None]:
    """Return a number of this unit and of the perfect reducer; none where an angle has no answer."""
    this, perfect = (None if np.isnan(value) else float(value / unit_of_measurement) for value in values[:2])
    return {"this_unit": this, "perfect_reducer": perfect}


def _own_loads(loop: HysteresisLoop) -> dict[str, float]:
    """Return what is read off the loop of bearings under their own loads."""
    return {
        "lost_motion_arcmin": float(loop.lost_motion[0] / ARCMINUTE),
        "torsional_stiffness_nm_per_arcmin": float(loop.torsional_stiffness[0] * ARCMINUTE),
    }


def _attributed(found: Attribution) -> dict[str, Any]:
    """Return which source makes how much of each main order, the source that moves the curve most first."""
    main, span = np.argsort(-found.amplitude)[:_SHOWN], np.ptp(found.contribution, axis=1)
    return {
        "orders": [int(order) for order in found.order[main]],
        "amplitude_arcsec": [float(value / ARCSECOND) for value in found.amplitude[main]],
        "sources": [
            {
                "source": found.sources[at],
                "peak_to_peak_arcsec": float(span[at] / ARCSECOND),
                "share_arcsec": [float(value / ARCSECOND) for value in found.share[at, main]],
            }
            for at in np.argsort(-span)
        ],
    }


def _short(value: float) -> str:
    """Return a number with four significant digits and no exponent for what users meet."""
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
