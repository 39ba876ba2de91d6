"""What one built unit does over one output turn: the curve, its orders, forces, lost motion, friction and sources."""

from __future__ import annotations

from functools import cached_property
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.reading.units import ARCMINUTE, ARCSECOND, DEGREE
from tolalloc.reducers.equivalent.friction import FrictionLoop
from tolalloc.reducers.equivalent.hysteresis import LOOP_ASSUMPTION, HysteresisLoop
from tolalloc.reducers.equivalent.model import Equilibria
from tolalloc.reducers.equivalent.outputs import Attribution, bearings_of, forces, outputs_of
from tolalloc.reducers.equivalent.perfect import PRELOAD_ASSUMPTION
from tolalloc.reducers.reducer.bearings import CONTACTS, friction_assumptions
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.idle_torque import IdleTorque
from tolalloc.reducers.transmission_error import TransmissionErrorResult
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.portraits.reducer import against_catalogue, linear_model_warnings, resonance_sentence, twist_table
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences

_say = Sentences("transmission_error")
_MAIN = 8
"""Main orders that are named [-]."""
_ON_TERMINAL = 5
"""Main orders that fit on a screen [-]."""
_PRINTED = 0.005
"""Smallest amplitude that does not print as 0.00 [arcsec]."""
_DRAWN = 60
"""Strongest orders that are drawn [-]."""
_UNIT = 0
"""Sample of a loop that is the unit [-]."""
_ANGLE, _ERROR = "carrier angle [°]", "transmission error [arcsec]"
_LOOP = {
    "lost_motion_arcmin": "lost motion at ±3 % of rated torque{} [arcmin]",
    "backlash_arcmin": "backlash{} [arcmin]",
    "torsional_stiffness_nm_per_arcmin": "torsional stiffness{} [N·m/arcmin]",
}
"""What is read off a loop: key of the summary → row of the table, with a gap for whose it is."""


class TransmissionErrorTeller(Teller[TransmissionErrorResult]):
    """What is said of one unit under one torque."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", model=self.header.model, unit=self.header.name, torque=self.result.torque)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Span and strongest orders, friction, rigidity beside the catalogue's, and where orders meet the resonance."""
        found, friction = self.summary, self.summary["friction"]
        strongest = ", ".join(_say("order", **wave) for wave in found["main_orders"][:3])
        orders = _say("strongest", orders=strongest) if strongest else _say("flat")
        rigidity, _ = self._rigidity
        stated = self.result.reducer.friction
        assumed = "" if None not in (stated.seals, stated.grease) else f" {_say('assumed')}"
        rubbing = _say("friction", **friction, assumed=assumed) if friction else ""
        load, orders_met = self.result.reducer.load, [order for order, *_ in self._main_orders if order > 0]
        resonance = resonance_sentence(self.result.reducer, self.result.torque, orders_met, load.input_speed)
        said = (_say("spans", **found | {"orders": orders}), rubbing, rigidity, resonance)
        return tuple(sentence for sentence in said if sentence)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Preload, what the linear model cannot tell, and a catalogue far away."""
        found, (_, far) = self.result, self._rigidity
        cautions = linear_model_warnings(found.reducer.cycloid_stage, found.reducer.modification)
        return (*self._preloaded, *cautions, *far)

    @cached_property
    def _rigidity(self) -> tuple[str, tuple[str, ...]]:
        return against_catalogue(self.result.equilibria.reducer, self.result.loop)

    @property
    def _preloaded(self) -> tuple[str, ...]:
        """Say that the unit presses itself without torque, if it does so by more than the rated torque would."""
        found, rated = self.result.preload, self.result.rated_pin_force
        if not found.pin_force[0] > rated:
            return ()
        taken, ratio = float(found.friction_torque[0]), abs(self.result.reducer.ratio)
        return (_say("preloaded", force=found.pin_force[0], rated=rated, output=taken, motor=taken / ratio),)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What neither the reducer's file nor the unit's prints, nor any source of loops, preload and friction."""
        reducer = self.result.reducer
        friction = friction_assumptions(reducer.friction, reducer.friction_dimensions)
        return (*self.header.assumptions, LOOP_ASSUMPTION, PRELOAD_ASSUMPTION, *friction)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The turn, the twist by parts, friction where it is known, and sources where they were asked for."""
        reducer, friction = self.result.equilibria.reducer, self.result.friction
        turn = Section(
            heading=_say("turn_heading"),
            figures=(self.curve_figure, self._order_figure, force_figure(self.result.equilibria)),
            tables=(("one turn", self.turn_table),),
            unfolded=True,
        )
        twist = (("twist", twist_table(reducer)),)
        found = [turn, Section(heading=_say("twist_heading"), paragraphs=(_say("twist"),), tables=twist)]
        if friction:
            found.append(
                Section(
                    heading=_say("friction_heading"),
                    paragraphs=(_say("friction_section"),),
                    figures=(_loop_figure(friction),),
                    tables=(("friction", _friction_table(reducer, friction.torque[-1], self.summary["friction"])),),
                )
            )
        if self.result.attribution is not None:
            table = (("attribution", self.attribution_table),)
            found.append(Section(heading=_say("sources_heading"), paragraphs=(_say("sources"),), tables=table))
        return tuple(found)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole turn, units of measurement in the names."""
        result = self.result
        extremes, reversed_by = result.extremes, result.reversed_by
        found = {
            "reducer": self.header.model,
            "unit": self.header.name,
            "torque_nm": result.torque,
            "peak_to_peak_arcsec": float(extremes.peak_to_peak[0] / ARCSECOND),
            "remaining_error_arcsec": float(extremes.remaining[0] / ARCSECOND),
            "largest_arcsec": float(extremes.largest[0] / ARCSECOND),
            "largest_at_deg": float(extremes.carrier_angle[0, 0] / DEGREE),
            "smallest_arcsec": float(extremes.smallest[0] / ARCSECOND),
            "smallest_at_deg": float(extremes.carrier_angle[0, 1] / DEGREE),
            "main_orders": [
                {"order": order, "amplitude_arcsec": amplitude / ARCSECOND, "phase_deg": phase / DEGREE}
                for order, amplitude, phase in self._main_orders
            ],
            "outputs": [
                {"name": name, "unit": unit, "value": float(value(result.solved)[0])}
                for name, (unit, value) in outputs_of(result.reducer).items()
            ],
            "pin_force_without_torque_n": float(result.preload.pin_force[0]),
            "largest_friction_torque_of_pins_without_load_nm": float(result.preload.friction_torque[0]),
            "lost_motion_arcmin": _pair(result.loop.lost_motion, ARCMINUTE),
            "backlash_arcmin": _pair(result.loop.backlash, ARCMINUTE),
            "torsional_stiffness_nm_per_arcmin": _pair(result.loop.torsional_stiffness, 1 / ARCMINUTE),
            "every_bearing_under_its_own_load": _own_loads(result.own_loads) if result.own_loads else None,
            "friction": _friction(result.friction, IdleTorque.of(result.reducer)) if result.friction else None,
            "reversal_arcsec": {
                "mean": float(reversed_by.mean() / ARCSECOND),
                "peak_to_peak": float(np.ptp(reversed_by) / ARCSECOND),
            },
            "angles": {
                "equally_spaced": result.equilibria.carrier_angle.size,
                "solved_in_all": int(extremes.solves[0]),
                "of_the_orders": result.orders.angles,
            },
            "largest_residual_of_largest_force": float(extremes.residual[0]),
            "statuses": dict(self.header.statuses),
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }
        if result.attribution is not None:
            found["attribution"] = _attributed(result.attribution, [order for order, *_ in self._main_orders])
        return found

    @property
    def _main_orders(self) -> list[tuple[float, float, float]]:
        """The strongest orders that print as more than 0.00″, with amplitude and phase [rad]."""
        return [own for own in self.result.orders.main(_MAIN) if own[1] >= _PRINTED * ARCSECOND]

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """The whole turn, and what each source adds if that was asked for."""
        turn = (self.turn_table, self.title)
        if self.result.attribution is None:
            return (turn,)
        shown = self.attribution_table.iloc[:, : 2 + _ON_TERMINAL]
        shown.columns = [str(name).removesuffix(" [arcsec]").removeprefix("order ") for name in shown]
        return turn, (shown.map(_tenths), _say("sources_on_terminal"))

    def add_files(self, folder: Path) -> None:
        """Add the curve at equally spaced angles, which `diagnose` and `lot` read, and its orders over the torque."""
        from tolalloc.reports.writer import write_csv, write_json

        found = self.result.equilibria
        columns = found.carrier_angle / DEGREE, found.transmission_error[0] / ARCSECOND
        curve = pd.DataFrame(dict(zip(("angle [deg]", "transmission error [arcsec]"), columns, strict=True)))
        curve["torque [N·m]"] = self.result.torque
        write_csv(curve, folder / "curve.csv")
        write_json({str(name): values.tolist() for name, values in curve.items()}, folder / "curve.json")
        heads = ("torque [N·m]", "order [-]", "amplitude [arcsec]", "phase of the cosine [deg]")
        scale = (1.0, 1.0, 1 / ARCSECOND, 1 / DEGREE)
        rows = np.array(self.result.orders_over_torque(_MAIN)).reshape(-1, len(heads)) * scale
        over = pd.DataFrame(rows, columns=list(heads))
        over[heads[1]] = [int(own) if own.is_integer() else own for own in over[heads[1]].tolist()]
        write_csv(over, folder / "orders_over_torque.csv")
        write_json({str(name): values.tolist() for name, values in over.items()}, folder / "orders_over_torque.json")

    @cached_property
    def turn_table(self) -> pd.DataFrame:
        """The whole turn, one quantity per row."""
        found = self.summary
        own, reversal = found["every_bearing_under_its_own_load"] or {}, found["reversal_arcsec"]
        rows = [
            ("peak-to-peak over one output turn [arcsec]", f"{found['peak_to_peak_arcsec']:.2f}"),
            ("finer angles may add [arcsec]", f"{found['remaining_error_arcsec']:.3f}"),
            (f"largest, at {found['largest_at_deg']:.2f}° [arcsec]", f"{found['largest_arcsec']:.2f}"),
            (f"smallest, at {found['smallest_at_deg']:.2f}° [arcsec]", f"{found['smallest_arcsec']:.2f}"),
            *(
                (
                    f"order {wave['order']:.6g} of the output turn, amplitude [arcsec] and phase",
                    f"{wave['amplitude_arcsec']:.2f} ∠ {wave['phase_deg']:.0f}°",
                )
                for wave in found["main_orders"]
            ),
            *((f"{item['name']} [{item['unit']}]", _short(item["value"])) for item in found["outputs"]),
            ("largest pin force without torque [N]", _short(found["pin_force_without_torque_n"])),
            *(
                (row.format(f", {whose.replace('_', ' ')}"), "not found" if value is None else _short(value))
                for key, row in _LOOP.items()
                for whose, value in found[key].items()
            ),
            *((_LOOP[key].format(", every bearing under its own load"), _short(value)) for key, value in own.items()),
            ("reversing the direction adds, mean [arcsec]", f"{reversal['mean']:.2f}"),
            ("reversing the direction adds, peak-to-peak [arcsec]", f"{reversal['peak_to_peak']:.2f}"),
            *((f"angles: {outcome} [-]", str(count)) for outcome, count in found["statuses"].items() if count),
            ("largest unbalanced force over largest force [-]", f"{found['largest_residual_of_largest_force']:.1e}"),
        ]
        return pd.DataFrame(rows, columns=["quantity", "value"])

    @cached_property
    def attribution_table(self) -> pd.DataFrame:
        """What each source adds to the curve and to the main orders, and what they make together."""
        found = self.summary["attribution"]
        names = [f"order {order:.6g} [arcsec]" for order in found["orders"]]
        rows = [(own["source"], own["peak_to_peak_arcsec"], *own["share_arcsec"]) for own in found["sources"]]
        rows.append(("together", float("nan"), *found["amplitude_arcsec"]))
        return pd.DataFrame(rows, columns=["source", "curve [arcsec]", *names])

    @property
    def curve_figure(self) -> Figure:
        """The curve and its refined extremes."""
        found, extremes = self.result.equilibria, self.result.extremes
        angle, error = found.carrier_angle / DEGREE, found.transmission_error[0] / ARCSECOND
        ends = [float(extremes.largest[0] / ARCSECOND), float(extremes.smallest[0] / ARCSECOND)]
        series = (
            Series.line(f"{angle.size} equally spaced angles", angle, error),
            Series.points("extremes, refined", (extremes.carrier_angle[0] / DEGREE).tolist(), ends),
        )
        title = _say("curve_figure", peak_to_peak=extremes.peak_to_peak[0] / ARCSECOND)
        return Figure("transmission_error", title, _ANGLE, _ERROR, series=series)

    @property
    def _order_figure(self) -> Figure:
        """The amplitudes of the strongest orders."""
        shown = sorted(self.result.orders.main(_DRAWN))
        x, y = [order for order, *_ in shown], [amplitude / ARCSECOND for _, amplitude, _ in shown]
        heads = _say("order_figure"), "order of the output turn [-]", "amplitude [arcsec]"
        return Figure("orders", *heads, series=(Series(label="amplitude", kind="stems", x=x, y=y),))


def force_figure(equilibria: Equilibria) -> Figure:
    """Draw the force of the most loaded pin and of the most loaded bearing of every kind over the turn [N]."""
    found = forces(equilibria)
    lines = {"pin": found.pins[0].max(axis=(1, 2))}
    lines |= {name: found.of(interface)[0].max(axis=1) for name, interface in bearings_of(equilibria.reducer).items()}
    angle = equilibria.carrier_angle / DEGREE
    series = tuple(Series.line(name, angle, values) for name, values in lines.items())
    return Figure("forces", _say("force_figure"), _ANGLE, "force [N]", series=series)


def _friction(loop: FrictionLoop, idle: IdleTorque) -> dict[str, Any]:
    """Return efficiency, loop, friction by contact of the unit, and what turns it beside, for a program."""
    rated, contacts = abs(loop.rated.torque), float(loop.no_load.friction_torque[_UNIT])
    driven = rated + float(loop.rated.friction_torque[_UNIT]) + idle.turning
    return {
        "efficiency_at_rated_torque_percent": 100.0 * float(loop.rated.efficiency[_UNIT]),
        "overall_efficiency_at_rated_torque_percent": 100.0 * rated / driven,
        "no_load_torque_nm": contacts + idle.turning,
        "no_load_torque_of_contacts_nm": contacts,
        "lost_motion_arcmin": float(loop.lost_motion[_UNIT] / ARCMINUTE),
        "hysteresis_loss_arcmin": float(loop.hysteresis_loss[_UNIT] / ARCMINUTE),
        "by_contact": [
            {
                "contact": CONTACTS[name],
                "rated_nm": float(torque[_UNIT]),
                "no_load_nm": float(loop.no_load.by_contact[name][_UNIT]),
            }
            for name, torque in loop.rated.by_contact.items()
        ],
        "seals_nm": idle.seals,
        "grease_nm": idle.grease,
    }


def _friction_table(reducer: Reducer, rated: float, found: dict[str, Any]) -> pd.DataFrame:
    """Return the friction torque of every kind of contact, at rated torque [N·m] and without torque."""
    coefficients = {CONTACTS[name]: f"{value:g}" for name, value in reducer.friction.coefficients.items()}
    rows = [(own["contact"], own["rated_nm"], own["no_load_nm"]) for own in found["by_contact"]]
    rows.append(("contacts together", sum(row[1] for row in rows), found["no_load_torque_of_contacts_nm"]))
    beside = {"seals": "seals_nm", "grease": "grease_nm", "with seals and grease": "no_load_torque_nm"}
    told = [
        (name, coefficients.get(name, ""), f"{at:.3g}", f"{100 * at / rated:.2f}", f"{none:.2g}")
        for name, at, none in rows
    ] + [(name, "", "", "", "?" if found[key] is None else f"{found[key]:.2g}") for name, key in beside.items()]
    heads = "contact", "coefficient [-]", "rated torque [N·m]", "of the rated torque [%]", "no-load torque [N·m]"
    return pd.DataFrame(told, columns=heads)


def _loop_figure(loop: FrictionLoop) -> Figure:
    """Return twist over torque with both branches."""
    lost_motion, loss = loop.lost_motion[_UNIT] / ARCMINUTE, loop.hysteresis_loss[_UNIT] / ARCMINUTE
    branches = {"torque rising": loop.rising, "torque falling": loop.falling}
    series = (Series.line(label, loop.torque, branch[_UNIT] / ARCMINUTE) for label, branch in branches.items())
    heads = _say("loop_figure", lost_motion=lost_motion, loss=loss), "torque on the carrier [N·m]", "twist [arcmin]"
    return Figure("hysteresis", *heads, series=tuple(series))


def _pair(values: Float[np.ndarray, " sample"], unit_of_measurement: float) -> dict[str, float | None]:
    """Return a number of this unit and of exact parts; none where an angle has no answer."""
    this, exact = (None if np.isnan(value) else float(value / unit_of_measurement) for value in values)
    return {"this_unit": this, "exact_parts": exact}


def _own_loads(loop: HysteresisLoop) -> dict[str, float]:
    """Return what is read off the loop of bearings under their own loads."""
    return {
        "lost_motion_arcmin": float(loop.lost_motion[0] / ARCMINUTE),
        "torsional_stiffness_nm_per_arcmin": float(loop.torsional_stiffness[0] * ARCMINUTE),
    }


def _attributed(found: Attribution, orders: list[float]) -> dict[str, Any]:
    """Return which source makes how much of each main order, the source that moves the curve most first."""
    main, span = [found.order.tolist().index(order) for order in orders], np.ptp(found.contribution, axis=1)
    return {
        "orders": orders,
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


def _tenths(cell: str | float) -> str:
    """Return a cell with one decimal; what is not there stays empty."""
    return cell if isinstance(cell, str) else "" if isnan(cell) else f"{cell:.1f}"


TELLER = TransmissionErrorTeller
