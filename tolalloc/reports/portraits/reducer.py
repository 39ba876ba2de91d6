"""What is said and shown of a reducer: words, curves of single units, the unit that moves, and what a check says."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.requirement import USUAL_YIELD
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Units
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, DEGREE, MEGAPASCAL, MICROMETRE, MICRORADIAN
from tolalloc.reducers import DISC_TEMPERATURE, FRICTION_TORQUE, PEAK_TO_PEAK, PRELOAD, RADIAL_CLEARANCE
from tolalloc.reducers.contact import contact_of
from tolalloc.reducers.cycloid.clearance import LARGE, is_large
from tolalloc.reducers.equivalent.hysteresis import HysteresisLoop
from tolalloc.reducers.equivalent.model import OUTCOMES, Equilibria
from tolalloc.reducers.equivalent.outputs import turn_orders
from tolalloc.reducers.equivalent.perfect import twist_shares
from tolalloc.reducers.equivalent.resonance import orders_of, resonance_of
from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.load_case import at
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.design import CycloidStage, Modification, Reducer
from tolalloc.reducers.reducer.idle_torque import IdleTorque
from tolalloc.reducers.scene import PER_CRANK_TURN, Scene, is_placed, scene_of
from tolalloc.reducers.settings import FLANK, RADIAL, TURNED
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.portrait import Examination, Portrait, SignSketch, sections_of
from tolalloc.reports.scene_record import scene_record
from tolalloc.reports.wording import number

if TYPE_CHECKING:
    import pandas as pd

    from tolalloc.drawings.error_model import ErrorModel
    from tolalloc.drawings.sources import Source
    from tolalloc.reducers.equivalent.sources import ErrorSource

_PHASES = 24
"""Angles of a turn of the crankshafts at which its turns are compared [-]."""
_ORDERS = 130
"""Orders of the output turn that a report lists [-]."""
_SPOKEN = {
    PRELOAD: "pin force without torque",
    FRICTION_TORQUE: "no-load friction torque",
    RADIAL_CLEARANCE: "least radial clearance",
}
"""Output → what a sentence and the first table call it, shorter than its name."""
_COARSE = 8
"""Angles per turn of the cranks in a report, which stays small [-]."""
_COUNTED = (
    "share preloaded [-]",
    "pin force of the rated torque [N]",
    "share without radial clearance [-]",
    "least radial clearance [µm]",
    "no-load torque of the pins, median [N·m]",
    "no-load torque of the pins, 99.73 % [N·m]",
)
"""What a summary says of the random units of a check."""

FACTOR = 1.5
"""Model over catalogue, or catalogue over model, from which on a difference is a warning [-]."""

USUAL_TWIST = 3.6
"""Rated torque over torsional rigidity of RV reducers in catalogues, 2.9 to 4.0 over all sizes [arcmin]."""

_FELT = 1.0
"""Least peak-to-peak of exact parts of which a sentence says that it is elastic [arcsec]."""

_LOADED = 0.1
"""Torque over rated torque from which on what exact parts have of it is the load's [-]."""

_MET = 5
"""Orders at most that a sentence says to meet a resonance, the slowest first [-]."""

_WITHOUT = "without radial clearance"
_ERROR = "transmission error, output side [arcsec]"

_MEANS = "A preloaded reducer turns, but it runs warm, wears early and has no lost motion until it has worn."
"""What pins that press without torque do to a reducer."""

_CARRIED = (
    "fewest pins in contact on a disc at rated torque [-]",
    "largest pin force at rated torque [N]",
    "peak pressure at rated torque [MPa]",
)


_SIGN_SKETCHES = (
    SignSketch(
        part="disc",
        caption="Δr_rp negative (drawn): the wheel, of radius r_rp + Δr_rp, is smaller than the pin and leaves "
        "material on the teeth. Positive: it is larger and removes material.",
        nominal=(0.0, 9.0),
        changed=(0.0, 7.0),
        arrow=(-9.0, -7.0),
    ),
    SignSketch(
        part="disc",
        caption="Δr_p negative (drawn): the wheel runs on the circle R_p + Δr_p, smaller than the pin circle, and "
        "removes material from the teeth. Positive: on a larger circle it leaves material.",
        nominal=(0.0, 9.0),
        changed=(-2.0, 9.0),
        arrow=(0.0, -2.0),
    ),
)
"""The grinding wheel smaller, and on a smaller circle."""


class ReducerPortrait(Portrait[ReducerModel], of=ReducerModel):
    """What is said and shown of a reducer at the sources of a drawing."""

    kind = "reducer"
    simulated = "simulated reducers"
    settings_word = "modification"
    uncertain_name = "identified stiffness"
    curve_height = PEAK_TO_PEAK
    sign_sketches = _SIGN_SKETCHES

    @property
    def outcomes(self) -> Mapping[int, str]:
        """Status → outcome of an equilibrium in words."""
        return OUTCOMES

    @property
    def facts(self) -> Mapping[str, Any]:
        """Torsional stiffness of exact parts between 3 % and 100 % of rated torque."""
        stiffness = float(self.model.exact_loop_in_force.torsional_stiffness[0] * ARCMINUTE)
        return {"torsional stiffness of exact parts [N·m/arcmin]": stiffness}

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Those of the reducer, of the built unit and of what the drawing leaves out."""
        model = self.model
        clearances = [name for name, value in asdict(model.reducer.clearances).items() if value == 0.0]
        without = (f"without clearance: {', '.join(clearances).replace('_', ' ')}",) if clearances else ()
        unit = model.unit.assumptions if model.unit else ()
        return (*model.reducer.assumptions, *unit, *self.left_out, *without)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Rigidity and lost motion beside the catalogue's."""
        sentence, _ = against_catalogue(self.model.reducer, self.model.exact_loop_in_force)
        return (sentence,) if sentence else ()

    @property
    def risks(self) -> tuple[str, ...]:
        """What of an error under load is elastic, and where orders meet the resonance of what the output turns."""
        own = self.model.reducer_in_force
        resonance = resonance_sentence(own, -own.load.rated_torque, orders_of(own), own.load.input_speed)
        return (*self._elastic, *([resonance] if resonance else []))

    @property
    def _elastic(self) -> Iterator[str]:
        """Say how much of a peak-to-peak exact parts have under a load, as a ring that gives makes it."""
        model, torques = self.model, {PEAK_TO_PEAK: self.model.kernel.torque}
        torques |= {at(PEAK_TO_PEAK, case): case.torque for case in model.load_cases if case.torque is not None}
        loaded = {name: own for name, own in torques.items() if abs(own) >= _LOADED * model.reducer.load.rated_torque}
        if not loaded:
            return
        exact = model.reading(tuple(loaded))(np.zeros((1, len(model.columns)))).values[0].tolist()
        for torque, value in zip(loaded.values(), exact, strict=True):
            if value >= _FELT:
                yield (
                    f"{value:.3g}″ of the peak-to-peak at {abs(torque):,.5g} N·m is elastic: exact parts have it too, "
                    "so no tolerance can remove it."
                )

    @property
    def not_included(self) -> str:
        """Wear and temperature, as far as neither the study nor one of its load cases states them."""
        cases = self.model.load_cases
        warm = DISC_TEMPERATURE in self.model.conditions or any(own.disc_temperature is not None for own in cases)
        left = [] if any(own.hours for own in cases) else ["wear"]
        left += [] if warm else ["temperature"]
        return " and ".join(left) or "shocks and lubrication"

    @property
    def spectra_note(self) -> str:
        """Which errors show at multiples of teeth or pins."""
        stage = self.model.reducer.cycloid_stage
        return (
            f"Errors that stand still in the housing appear at multiples of {stage.disc_teeth}, errors that turn with "
            f"disc or carrier at multiples of {stage.pin_count}"
        )

    def kind_of(self, source: Source) -> ErrorSource | None:
        """Return the kind of a source, as its spring group declares it."""
        return family_of(self.model.reducer).sources.of(source.name)

    def display_name(self, output: str) -> str:
        """Return what a sentence calls an output; there is one peak-to-peak, and one friction without load."""
        name, bracket, unit = output.partition(" [")
        base, _, case = name.rpartition(", ")
        if any(case == own.name for own in self.model.load_cases):
            return f"{self.display_name(f'{base}{bracket}{unit}')}, {case}"
        return _SPOKEN.get(output, super().display_name(output).removesuffix(" transmission error"))

    def amounts(self, values: Float[np.ndarray, " setting"]) -> Mapping[str, float]:
        """Return the amounts that a grinder sets, and the clearances that they leave [µm]."""
        modification = self.model.modification(values)
        drawn = {
            "equidistant Δr_rp [µm]": modification.equidistant / MICROMETRE,
            "shift Δr_p [µm]": modification.shift / MICROMETRE,
            "rotation δ [µrad]": modification.rotation / MICRORADIAN,
        }
        settings = dict(zip((TURNED, FLANK, RADIAL)[-len(values) :], map(float, values), strict=True))
        return {**dict(list(drawn.items())[: len(values)]), **settings}

    def effects(self, values: Float[np.ndarray, " setting"]) -> Mapping[str, str]:
        """Return what the sign of each amount does to the teeth, and where the clearances are measured."""
        modification = self.model.modification(values)
        return {
            "equidistant Δr_rp [µm]": _effect(modification.equidistant, "wheel larger", "wheel smaller"),
            "shift Δr_p [µm]": _effect(-modification.shift, "wheel deeper in the disc", "wheel farther out"),
            "rotation δ·r_d [µm]": _effect(modification.rotation, "tooth narrower", "tooth wider"),
            FLANK: "target: nominal gap where cos φ = K1",
            RADIAL: "target: nominal gap at tip and root",
            TURNED: "target: flank clearance that turned flanks leave",
        }

    def cautions(self, values: Float[np.ndarray, " setting"]) -> tuple[str, ...]:
        """Return what a reader must know of a large modification, and of a stiffness far from any catalogue."""
        model = self.model
        _, far = against_catalogue(model.reducer, model.at(values).exact_loop_in_force)
        return (*linear_model_warnings(model.reducer.cycloid_stage, model.modification(values)), *far)

    def examination(self, figures: Mapping[str, float]) -> Examination:
        """Return sizes that differ, clearances, how many random units are preloaded, and what frees them."""
        return _examination(self, figures)

    def illustrated(self, units: Units) -> tuple[Section, ...]:
        """Return the curves and orders of units, with the built unit first, and how exact parts carry rated torque."""
        return sections_of("Single units over one output turn", lambda: _illustrated(self.model, units))

    def pictured(self, units: Units) -> tuple[Figure, ...]:
        """Return the curves and the orders of units."""
        model, curves = self.model, _curves(self.model, units)
        return _curve_figure(curves, model.kernel.torque), _order_figure(model, _order_table(model, curves))

    def scene(
        self,
        settings: Float[np.ndarray, " setting"],
        x: Float[np.ndarray, " column"],
        unit: str,
        sources: tuple[str, ...],
    ) -> dict[str, Any]:
        """Return the reducer as it moves with this unit's errors, coarse enough to be sent at once."""
        return scene_record(_scene(self.model.at(settings), x, unit, sources), coarse=True)

    def moving(
        self, errors: ErrorModel, x: Float[np.ndarray, " column"], shares: Mapping[str, float], unit: str
    ) -> tuple[Section, ...]:
        """Return the moving picture of a unit, coloured by its sources' shares."""
        return sections_of("The reducer", lambda: _moving(self.model, errors, x, shares, unit))


def _effect(removed: float, more: str, less: str) -> str:
    """Return what an amount does that removes so much along the normal at tip and root, or leaves it if negative."""
    if removed == 0.0:
        return "none"
    return f"{more}: removes material" if removed > 0.0 else f"{less}: leaves material"


# What every report says


def against_catalogue(reducer: Reducer, loop: HysteresisLoop) -> tuple[str, tuple[str, ...]]:
    """Return a sentence on rigidity and lost motion beside the catalogue's, and warnings where they are far apart.

    The loop's last sample is that of exact parts. Without a catalogue the sentence is empty, and the warning is about
    what all sizes of catalogues have in common.
    """
    stated = reducer.catalogue
    rigidity, lost = loop.torsional_stiffness[-1] * ARCMINUTE, loop.lost_motion[-1] / ARCMINUTE
    if stated is None:
        twist = reducer.load.rated_torque / rigidity
        if USUAL_TWIST / FACTOR**2 <= twist <= USUAL_TWIST * FACTOR**2:
            return "", ()
        return "", (
            f"Exact parts twist by {twist:.2g}′ under their rated torque; reducers in catalogues twist by 3 to 4′. Do "
            "not trust results that depend on the load: state bearings by their dimensions, or a [catalogue] to "
            "compare with.",
        )
    wanted, largest = stated.torsional_rigidity * ARCMINUTE, stated.lost_motion / ARCMINUTE
    sentence = (
        f"With exact parts the torsional rigidity is {rigidity:.3g} N·m/arcmin, the catalogue states {wanted:.3g} "
        f"({number(100 * (rigidity / wanted - 1), '+.0f')} %); the lost motion is {lost:.2g}′, the catalogue allows "
        f"{largest:.2g}′."
    )
    warnings = []
    if not 1 / FACTOR <= rigidity / wanted <= FACTOR:
        off = rigidity / wanted
        times = f"{off:.3g} times as stiff as" if off > 1 else f"{1 / off:.3g} times softer than"
        warnings.append(f"The model is {times} the catalogue states: do not trust results that depend on the load.")
    if lost > largest:
        warnings.append(f"The lost motion of exact parts, {lost:.2g}′, is above the catalogue's {largest:.2g}′.")
    return sentence, tuple(warnings)


def linear_model_warnings(stage: CycloidStage, modification: Modification) -> tuple[str, ...]:
    """Return what a reader of a model with linear gaps must know of a modification, if anything."""
    if not is_large(stage, modification):
        return ()
    return (
        f"The modification is above {LARGE / MICROMETRE:g} µm, where the linear gaps of the equivalent model are no "
        "longer accurate to 0.3 µm; tolalloc contact uses exact distances.",
    )


def twist_table(reducer: Reducer) -> pd.DataFrame:
    """Return which part makes how much of the twist at rated torque."""
    import pandas as pd

    rows = [
        (own.part, round(100.0 * own.share, 2), round(own.stiffness * MICROMETRE, 1)) for own in twist_shares(reducer)
    ]
    return pd.DataFrame(rows, columns=["part", "share of the twist [%]", "stiffness under its force [N/µm]"])


# What a check says


def _examination(portrait: ReducerPortrait, figures: Mapping[str, float]) -> Examination:
    """Return what is said of the nominal clearances, of the counted random units and of the catalogue."""
    model, count, solved = portrait.model, int(figures["units [-]"]), int(figures["units in equilibrium [-]"])
    _, *mean = model.reducer_in_force.modification.clearances(model.reducer.cycloid_stage)
    loop, (flank, radial) = model.exact_loop_in_force, (own / MICROMETRE for own in mean)
    if not solved:
        none = f"None of {count:,} simulated reducers has an equilibrium without torque."
        but = f"none of its units has an equilibrium: {_advice(model)}"
        sentences = (*model.mismatches, none, *portrait.remarks, *portrait.risks)
        return Examination(sentences, but, f"Cannot be built as drawn: {none}")
    counted = {name: figures[name] for name in _COUNTED}
    unsolved = "" if solved == count else f" ({count - solved} have no equilibrium)"
    cautions = portrait.cautions(np.array(model.present_clearances))
    half, least = figures["median pin force without torque [N]"], figures["least radial clearance [µm]"]
    sentences = (
        *model.mismatches,
        f"Parts in the middle of their zones have {number(flank, '.3g')} µm of clearance on the flank and "
        f"{number(radial, '.3g')} µm at tip and root; the whole reducer has "
        f"{loop.backlash[0] / ARCMINUTE:.2f}′ of backlash and {loop.lost_motion[0] / ARCMINUTE:.2f}′ of lost motion.",
        f"Of {count:,} simulated reducers {number(figures['share preloaded [-]'], '.1%')} are preloaded"
        f"{unsolved}: without torque their largest pin force is above "
        f"the {model.rated_pin_force:,.0f} N of the rated torque. Half of all reach "
        f"{float(f'{half:.2g}'):,g} N or more.",
        _no_load(model, figures),
        f"The tightest of these reducers has {number(least, '.2g')} µm of radial clearance.",
        *portrait.remarks,
        *portrait.risks,
        *cautions,
    )
    reasons = _reasons(model, counted)
    if not reasons:
        return Examination(sentences, figures=counted)
    trust = " ".join(own for own in cautions if "not trust" in own)
    preloaded, overlaps = (figures[f"share {own} [-]"] > 1 - USUAL_YIELD for own in ("preloaded", _WITHOUT))
    what = "Cannot be built as drawn" if overlaps else "Should not be released as drawn"
    means = f" {_MEANS} {_no_load(model, figures)}" if preloaded else ""
    fault = f"{what}: of {count:,} simulated reducers {' and '.join(reasons)}.{means} {trust}".strip()
    return Examination(sentences, f"of its units {' and '.join(reasons)}: {_advice(model)}", fault, counted)


def resonance_sentence(reducer: Reducer, torque: float, orders: Iterable[float], fastest: float | None) -> str:
    """Return the first resonance with the load's inertia and which orders meet it up to a speed of the input [rpm].

    Empty where the file states no inertia; without a speed all orders are told.
    """
    if (inertia := reducer.load.inertia) is None:
        return ""
    try:
        found = resonance_of(reducer, torque, inertia)
    except SolveError as fault:  # what else a report says stands
        return f"The first resonance is not known: {fault}"
    said = f"With {inertia:.4g} kg·m² at the output the first resonance is at {found.frequency:.3g} Hz"
    met = found.met(orders, inf if fastest is None else fastest)
    if not met:
        return f"{said}; no order of the gear train excites it up to {fastest:,.5g} rpm at the input."
    shown = list(met.items())[:_MET]
    which, speeds = (
        _listed(own) for own in zip(*((f"{order:.6g}", f"{speed:,.0f}") for order, speed in shown), strict=True)
    )
    if len(shown) == 1:
        return f"{said}; order {which} of the output excites it at {speeds} rpm at the input."
    return f"{said}; orders {which} of the output excite it at {speeds} rpm at the input."


def _listed(own: Sequence[str]) -> str:
    """Return names or numbers as a sentence lists them."""
    return f"{', '.join(own[:-1])} and {own[-1]}" if len(own) > 1 else own[0]


def _no_load(model: ReducerModel, figures: Mapping[str, float]) -> str:
    """Return what the pins' friction takes without load, at the output and at the motor, beside the catalogue."""
    half, most = (figures[f"no-load torque of the pins, {which} [N·m]"] for which in ("median", "99.73 %"))
    rated, stated, idle = model.reducer.load.rated_torque, _catalogue_no_load(model), IdleTorque.of(model.reducer)
    beside = f"; the catalogue allows {stated:.3g} N·m in all" if stated else ""
    assumed = "" if None not in (model.reducer.friction.seals, model.reducer.friction.grease) else " (assumed)"
    more = f"Seals, grease and preloaded rollers take {number(idle.together, '.2g')} N·m more{assumed}"
    if idle.seals is None:
        more = "Seals and grease are not included"
    return (
        f"Without load, pin friction takes up to {number(half, '.2g')} N·m at the output in half of them and up to "
        f"{number(most, '.2g')} N·m in 99.73 %: {number(100 * most / rated, '.2g')} % of the rated torque, "
        f"{number(most / abs(model.reducer.ratio), '.2g')} N·m at the motor. {more}{beside}."
    )


def _catalogue_no_load(model: ReducerModel) -> float | None:
    """Return what the catalogue allows without load at the output, if it says so [N·m]."""
    return model.reducer.catalogue.no_load_torque if model.reducer.catalogue else None


def _reasons(model: ReducerModel, figures: Mapping[str, float]) -> list[str]:
    """Return what keeps more units from being built than usually may miss a limit."""
    found, allowed = [], 1 - USUAL_YIELD
    if (share := figures["share preloaded [-]"]) > allowed:
        by = "" if PRELOAD in model.own_limits else ", by stiffnesses that no dimensions support"
        force = figures["pin force of the rated torque [N]"]
        more = f"the largest pin force is above the {force:,.0f} N of rated torque{by}"
        found.append(f"{number(share, '.1%')} are preloaded ({more})")
    most = figures["no-load torque of the pins, 99.73 % [N·m]"] + IdleTorque.of(model.reducer).together
    stated = _catalogue_no_load(model)
    if stated and most > stated:
        found.append(
            f"99.73 % take up to {number(most, '.2g')} N·m without load (the catalogue allows {stated:.3g} N·m)"
        )
    if (share := figures["share without radial clearance [-]"]) > allowed:
        least = number(figures["least radial clearance [µm]"], ".2g")
        found.append(f"{number(share, '.1%')} have no radial clearance ({least} µm at worst)")
    return found


def _advice(model: ReducerModel) -> str:
    """Return what frees preloaded units, as the end of a sentence."""
    flank, (_, chosen, _) = model.present_clearances[-2], model.ranges
    freely = (
        "flank_clearance of ta.reducer(...) lets the allocation open it, at present from "
        f"{chosen[0] / MICROMETRE:.3g} to {chosen[1] / MICROMETRE:.3g} µm"
        if chosen
        else "flank_clearance=(smallest, largest) of ta.reducer(...) would let the allocation open it"
    )
    return (
        f"a tooth modification with more flank clearance than the present {number(flank, '.3g')} µm frees them; "
        f"`tolalloc modify` proposes one, and {freely}"
    )


# Curves of single units


def _illustrated(model: ReducerModel, units: Units) -> tuple[Section, ...]:
    curves = _curves(model, units)
    orders = _order_table(model, curves)
    return (
        Section(
            heading="Single units over one output turn",
            figures=(
                _curve_figure(curves, model.kernel.torque),
                _crank_turn_figure(curves, model.reducer),
                _order_figure(model, orders),
            ),
            tables=(("orders of units", orders),),
        ),
        Section(
            heading="How exact parts carry the rated torque",
            paragraphs=(
                "Hertzian line contact on the most loaded disc, with Li Lixing's load share; no numbers where a "
                "modification interferes before any load.",
            ),
            tables=(("contact", _contact_table(model, units)),),
        ),
    )


def _curves(model: ReducerModel, units: Units) -> dict[str, Equilibria]:
    """Return the curve of every unit."""
    kernel, curves = model.kernel, {}
    if model.unit:
        own = model.unit.errors(kernel.model.columns, model.reducer.modification.deviations)
        curves[f"unit {model.unit.name}"] = kernel.model.equilibria(own, kernel.torque)
    for label, (settings, x) in units.items():
        errors = model.at(settings).kernel.errors(x[np.newaxis])
        curves[label] = kernel.model.equilibria(errors, kernel.torque)
    return curves


def _curve_figure(curves: Mapping[str, Equilibria], torque: float) -> Figure:
    title = f"Transmission error over one output turn at {number(torque, 'g')} N·m"
    series = (
        Series.line(label, curve.carrier_angle / DEGREE, curve.transmission_error[0] / ARCSECOND)
        for label, curve in curves.items()
    )
    return Figure("transmission_error", title, "carrier angle [°]", _ERROR, series=tuple(series))


def _crank_turn_figure(curves: Mapping[str, Equilibria], reducer: Reducer) -> Figure:
    """Return the same over one turn of the crankshafts: the mean of all their turns, and between which they lie."""
    title = "The same over one turn of the crankshafts: mean of all turns, with a band that contains each of them"
    series = (_crank_turn(label, curve, reducer.cycloid_stage.disc_teeth) for label, curve in curves.items())
    return Figure("crank_turn", title, "crank angle [°]", _ERROR, series=tuple(series))


def _crank_turn(label: str, curve: Equilibria, disc_teeth: int) -> Series:
    """Return the curve of a unit folded onto one turn of the crankshafts."""
    phase = (curve.carrier_angle * disc_teeth / (2 * np.pi)) % 1.0
    place = (phase * _PHASES + 0.5).astype(int) % _PHASES
    errors = curve.transmission_error[0] / ARCSECOND
    parts = [errors[place == at] for at in range(_PHASES)]
    known = [at for at, own in enumerate(parts) if own.size]
    low, mean, high = zip(
        *((float(own.min()), float(own.mean()), float(own.max())) for own in parts if own.size), strict=True
    )
    return Series.line(label, [360.0 / _PHASES * at for at in known], mean, low, high)


def _order_table(model: ReducerModel, curves: Mapping[str, Equilibria]) -> pd.DataFrame:
    """Return the amplitudes of the first orders, and of those that gears make, as far as the angles hold them."""
    import pandas as pd

    kernel, columns = model.kernel.model, dict[str, Any]()
    for label, curve in curves.items():
        found = turn_orders(kernel, curve.errors, curve.torque, kernel.search.coarse)
        shown = np.isclose(found.order[:, np.newaxis], [*range(1, _ORDERS + 1), *model.reducer.open_orders]).any(axis=1)
        columns["order of the output turn [-]"] = found.order[shown].round(3)
        columns[f"{label} [arcsec]"] = found.amplitude[0, shown] / ARCSECOND
    return pd.DataFrame(columns)


def _order_figure(model: ReducerModel, orders: pd.DataFrame) -> Figure:
    stage, (order, *units) = model.reducer.cycloid_stage, map(str, orders)
    turning = f"of {stage.pin_count} turn with disc or carrier"
    title = f"Orders: multiples of {stage.disc_teeth} stand still with the housing, {turning}"
    series = (
        Series(label=own.removesuffix(" [arcsec]"), kind="stems", x=list(orders[order]), y=list(orders[own]))
        for own in units
    )
    return Figure("orders_of_units", title, order, "amplitude, output side [arcsec]", series=tuple(series))


def _contact_table(model: ReducerModel, units: Units) -> pd.DataFrame:
    """Return amounts, clearances and how exact parts carry, for the modification of every unit."""
    import pandas as pd

    columns: dict[str, dict[str, float]] = {}
    for label, (settings, _) in units.items():
        amounts, own = model.modification(settings), model.at(settings)
        mean, stage = own.reducer_in_force.modification, model.reducer.cycloid_stage
        columns[label] = {
            "equidistant Δr_rp [µm]": amounts.equidistant / MICROMETRE,
            "shift Δr_p [µm]": amounts.shift / MICROMETRE,
            **({"rotation δ [µrad]": amounts.rotation / MICRORADIAN} if amounts.rotation else {}),
            "flank clearance of mean parts [µm]": mean.flank_clearance(stage) / MICROMETRE,
            "radial clearance of mean parts at tip and root [µm]": mean.radial_clearance / MICROMETRE,
            "backlash of mean parts at the output [arcmin]": own.exact_loop_in_force.backlash[0] / ARCMINUTE,
            **_carried(own.reducer_in_force),
        }
    shown = {label: f"{label.removeprefix('median unit ')} [unit of the amount]" for label in columns}
    frame = pd.DataFrame(columns).rename(columns=shown)
    return frame.rename_axis("amount").reset_index()


def _carried(reducer: Reducer) -> dict[str, float]:
    """Return how exact parts carry the rated torque; not a number where they interfere before any load."""
    values, torque = [np.nan] * len(_CARRIED), -reducer.load.rated_torque
    with suppress(InputError):
        found = contact_of(reducer, torque, law=reducer.stiffness.pin_contact_law)
        if own := found.yielding:
            values = [own.pins_in_contact[0], own.largest_force, own.pressure / MEGAPASCAL]
    return dict(zip(_CARRIED, values, strict=True))


# The unit that moves


def _scene(
    model: ReducerModel,
    x: Float[np.ndarray, " column"],
    unit: str,
    sources: tuple[str, ...],
    per_crank_turn: int = PER_CRANK_TURN,
) -> Scene:
    """Return the scene of one unit's deviations [m, angles rad], with so many angles per turn of the cranks [-]."""
    kernel, placed = model.kernel, tuple(filter(is_placed, sources))
    errors = kernel.errors(x[np.newaxis])[0]
    return scene_of(kernel.model, errors, kernel.torque, unit=unit, sources=placed, per_crank_turn=per_crank_turn)


def _moving(
    model: ReducerModel, errors: ErrorModel, x: Float[np.ndarray, " column"], shares: Mapping[str, float], unit: str
) -> tuple[Section, ...]:
    """Return the section with the moving picture of one unit [m, angles rad], coloured by its sources' shares [-]."""
    from tolalloc.reports.moving_picture import MovingPicture, strongest

    named = tuple(source.name for source in errors.sources)
    elsewhere = ", ".join(name for name in named if not is_placed(name))
    scene = _scene(model, x, unit, named, per_crank_turn=_COARSE)
    said = (
        f"The {unit} in true proportion, with errors and gaps magnified. The stronger the colour of a place, the "
        "larger the joint share of its sources, relative to the place with the largest share. Point at a place to "
        "see its sources, and at a source in a table to see its place.",
        *((f"Not shown in the picture: {elsewhere}.",) if elsewhere else ()),
    )
    record, strength = scene_record(scene, coarse=True), strongest(shares, scene.place_by_source)
    picture = MovingPicture("reducer", f"{model.name}, {unit}", record=record, shares=strength)
    return (Section(heading="The reducer", paragraphs=said, figures=(picture,)),)
