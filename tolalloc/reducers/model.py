"""The equivalent model of a reducer as a `tolalloc.models.model.Model`: what every question asks of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.exceptions import UnknownNameError
from tolalloc.models.model import Evaluation, Model, Observer, Response, Samples, SettingDerivatives, unobserved
from tolalloc.models.settings import DrawnAmounts, Setting
from tolalloc.models.unit_bounds import ScaledUnits
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reducers import DISC_TEMPERATURE, FRICTION_TORQUE, PEAK_TO_PEAK, PRELOAD, RADIAL_CLEARANCE, TORQUE
from tolalloc.reducers.cycloid.solvers import LINEAR
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES, HysteresisLoop, hysteresis_loop
from tolalloc.reducers.equivalent.interfaces import pin_terms
from tolalloc.reducers.equivalent.perfect import preload, rated_pin_force
from tolalloc.reducers.equivalent.wear import wear_of
from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.load_case import LoadCase, OverLoadCases, at, combined_outputs
from tolalloc.reducers.reducer.design import MODIFICATION_CONVENTION, ROTATION_CONVENTION, Modification, Reducer
from tolalloc.reducers.reducer.idle_torque import IdleTorque
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.response.kernel import (
    SEEN,
    KernelResponse,
    OutputsWithStiffness,
    StiffnessResponse,
    principal_axes,
    stiffness_source,
)
from tolalloc.reducers.response.outputs import (
    DIFFERENTIABLE,
    WITH_FRICTION,
    LoadCasesResponse,
    OutputsResponse,
    limited_outputs,
    output_derivatives,
    readings_of,
    wave_outputs,
    with_orders,
)
from tolalloc.reducers.settings import Ranges, clearance_settings
from tolalloc.reducers.unit_file import BuiltUnit
from tolalloc.running.chunks import Mapper

if TYPE_CHECKING:
    from tolalloc.reducers.equivalent.peak_bounds import PeakBounds

_MULTIPLES = 4
"""Multiples of pins and teeth whose waves are told apart [-]."""
_ANGLES = (468, 936)
"""Angles at which the contact is solved without a search between them [-]."""
_NEARLY_ALL = 0.9973
"""Share of units that stay below the no-load torque which is said of all [-]."""
_WIDEST_TEMPERATURE = 20.0
"""Difference of temperature that the live page offers either way [K]."""
_MOST_COLUMNS = 100
"""Columns beyond which all products of two are more than the samples can tell apart [-]."""


@dataclass(frozen=True, kw_only=True)
class ReducerModel(Model):
    """The equivalent model of a reducer at the sources of a drawing."""

    kernel: KernelResponse  # Its peak-to-peak at the modification in force
    ranges: Ranges = (None, None, None)  # Of the clearances that the modification may leave [m]
    identified: IdentifiedStiffness | None = None  # Stiffnesses that replaced the reducer's own, if any
    load_cases: tuple[LoadCase, ...] = ()  # Under which outputs may be limited beside the conditions in force
    # Values of the settings in force; those of the reducer's own modification unless given [µm]
    clearances: tuple[float, ...] | None = None
    unit: BuiltUnit | None = None  # Built unit whose curve is shown beside others, if any
    left_out: tuple[str, ...] = ()  # What binding the drawing to the reducer assumed
    middles: tuple[float, ...] = ()  # Where the kernel's columns stand in mean parts, 0 unless given [m, angles rad]
    mismatches: tuple[str, ...] = ()  # Where sizes of the drawing are not those of the reducer, in sentences

    @property
    def reducer(self) -> Reducer:
        """The reducer with the stiffness in use."""
        return self.kernel.model.reducer

    @property
    def reducer_in_force(self) -> Reducer:
        """The same with a modification that leaves on nominal pins in nominal grooves the gaps of the mean unit.

        It holds the clearances in force, what warm discs shift, and pins or grooves of a fit.
        """
        errors = dict(zip(self.kernel.model.columns, self.mean_unit[0].tolist(), strict=True))
        pins = np.zeros(3 * self.reducer.cycloid_stage.pin_count)
        for name, terms in pin_terms(self.reducer, self.kernel.model.orders).items():
            for entry, share in terms:
                pins[entry] += share * errors[name]
        first, *_ = all_pins = pins.reshape(3, -1).T
        radial, _, radius = (first + (all_pins - first).mean(axis=0)).tolist()  # equal ones keep every bit
        amounts = Modification(equidistant=-radius, shift=-radial, rotation=errors["modification.rotation"])
        return replace(self.reducer, modification=amounts)

    @property
    def _chosen(self) -> Reducer:
        """The reducer with the modification that leaves the clearances in force."""
        if self.clearances is None:
            return self.reducer
        return replace(self.reducer, modification=self.modification(np.array(self.clearances)))

    @property
    def name(self) -> str:
        """The reducer's."""
        return self.reducer.name

    @property
    def columns(self) -> tuple[str, ...]:
        """The kernel's columns [m, angles rad]."""
        return self.kernel.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """All that requirements may limit, the peak-to-peak first, then load cases, their worst and mean."""
        return (*self._own_outputs, *(name for own in self._under_cases.values() for name in own), *self._combined)

    @cached_property
    def _own_outputs(self) -> tuple[str, ...]:
        """Outputs under the conditions in force."""
        return limited_outputs(self.reducer)

    @cached_property
    def _under_cases(self) -> Mapping[LoadCase, Mapping[str, str]]:
        """Load case → output under it → its name under the conditions in force."""
        return {
            case: {at(name, case): name for name in self._own_outputs if case.felt_by(name)} for case in self.load_cases
        }

    @cached_property
    def _combined(self) -> Mapping[str, OverLoadCases]:
        """Output over all load cases → what it is made of."""
        return combined_outputs(self.load_cases, self._own_outputs)

    def _under(self, case: LoadCase) -> ReducerModel:
        """Return the model under a load case, its parts worn by the others if it states hours."""
        kernel, own = self.kernel.under(case), self.kernel
        if case.hours:
            worn = wear_of(self._chosen, self.load_cases, case.hours, own.torque, own.disc_temperature)
            kernel = kernel.worn(worn)
        return replace(self, kernel=kernel, load_cases=())

    def _everywhere(self, outputs: tuple[str, ...]) -> tuple[str, ...]:
        """Return outputs under the conditions in force, under load cases, and over all of them.

        The transmission error of a part of the turn or of its orders is searched without derivatives, and wear follows
        its errors by steps that have none.
        """
        cases = [
            name
            for case, names in self._under_cases.items()
            for name, own in names.items()
            if own in outputs and not case.hours and not (case.is_of_part and own == PEAK_TO_PEAK)
        ]
        combined = [name for name, own in self._combined.items() if {*own.of} <= {*outputs, *cases}]
        return (*outputs, *cases, *combined)

    @property
    def ranked(self) -> tuple[str, ...]:
        """All but those with friction, which ask for more than twice the equilibria of the other outputs of a loop.

        Those under load cases multiply the equilibria too.
        """
        return tuple(name for name in self._own_outputs if name not in WITH_FRICTION)

    def reading(self, outputs: tuple[str, ...]) -> Response:
        """Return the response of these outputs, waves of `spectra` among them if need be."""
        waves = {name for names in self.spectra.values() for name in names}
        for name in outputs:
            if name not in self.outputs and name not in waves:
                raise UnknownNameError.among(self.name, "output", name, self.outputs)
        in_force = {*self._own_outputs, *waves}
        if in_force.issuperset(outputs):
            return self._reading(outputs)
        combined = self._combined
        asked = dict.fromkeys(part for name in outputs for part in (combined[name].of if name in combined else (name,)))
        named = [(self, {name: name for name in asked if name in in_force})] + [
            (self._under(case), {name: own for name, own in names.items() if name in asked})
            for case, names in self._under_cases.items()
        ]
        present = [(model, names) for model, names in named if names]
        responses = [model._reading(tuple(names.values())) for model, names in present[:1]]
        # A unit is counted once, as it ended under the first of them.
        responses += [model.observed(unobserved)._reading(tuple(names.values())) for model, names in present[1:]]
        return LoadCasesResponse(
            responses=tuple(responses),
            read=tuple(name for _, names in present for name in names),
            outputs=outputs,
            combined=combined,
        )

    def _reading(self, outputs: tuple[str, ...]) -> Response:
        """Return the response of outputs and waves under the conditions in force."""
        if outputs == (PEAK_TO_PEAK,):
            return self.kernel
        waves = {name: order for order, names in self.spectra.items() for name in names}
        orders = tuple(dict.fromkeys(waves[name] for name in outputs if name in waves))
        readings = readings_of(self.reducer, outputs)
        response = OutputsResponse(kernel=self.kernel, readings=with_orders(readings, orders) if orders else readings)
        return response if response.outputs == outputs else replace(response, chosen=outputs)

    @property
    def settings(self) -> tuple[Setting, ...]:
        """Flank and radial clearance, before them the rotation clearance where flanks are turned or may be."""
        present = self.present_clearances
        ranges = self.ranges[-len(present) :]
        bounds = ((own[0] / MICROMETRE, own[1] / MICROMETRE) if own else None for own in ranges)
        return clearance_settings(present, bounds)

    @property
    def present_clearances(self) -> tuple[float, ...]:
        """Values of the settings in force [µm]."""
        own = self.reducer.modification
        count = 3 if self.ranges[0] or own.rotation else 2
        present = own.clearances(self.reducer.cycloid_stage)[-count:]
        return self.clearances or tuple(clearance / MICROMETRE for clearance in present)

    def at(self, values: Float[np.ndarray, " setting"]) -> ReducerModel:
        """Return the model whose modification leaves other clearances [µm]."""
        kernel = self.kernel.with_modification(self.modification(values))
        return replace(self, kernel=kernel, clearances=tuple(map(float, values)))

    def modification(self, values: Float[np.ndarray, " setting"]) -> Modification:
        """Return the amounts that leave the clearances [µm]."""
        *turned, flank, radial = (float(value) * MICROMETRE for value in values)
        return Modification.from_clearances(flank, radial, self.reducer.cycloid_stage, *turned)

    @property
    def _amounts(self) -> tuple[str, ...]:
        """Error columns of the amounts that the settings choose, as many as settings."""
        return tuple(self.reducer.modification.deviations)[: len(self.present_clearances)]

    @cached_property
    def _modification_by_clearance(self) -> Float[np.ndarray, "amount setting"]:
        """Change of equidistant, shift and rotation amount (rows) with the settings (columns) [-, rotation rad/m]."""
        columns = [self.modification(unit / MICROMETRE).deviations for unit in np.eye(len(self._amounts))]
        return np.array([[column[name] for column in columns] for name in self._amounts])

    @property
    def exact(self) -> tuple[str, ...]:
        """The peak-to-peak alone, under every load case of the whole turn."""
        return self._everywhere((PEAK_TO_PEAK,))

    @property
    def stated_rate(self) -> float:
        """Of the limited outputs of a reducer of its family, its bearings yielding, on two cores [1/s]."""
        return family_of(self.reducer).rate

    @property
    def differentiable(self) -> tuple[str, ...]:
        """What is read off torque against twist, what presses without torque, and the gap at tip and root."""
        return self._everywhere(DIFFERENTIABLE)

    def derivatives(self, output: str, x: Samples) -> SettingDerivatives:
        """Return the peak-to-peak, or an output of `differentiable`, of every sample with its derivatives."""
        if output in self._combined:
            return self._combined_derivatives(self._combined[output], x)
        for case, names in self._under_cases.items():
            if output in names and output in (*self.exact, *self.differentiable):
                return self._under(case).derivatives(names[output], x)
        if output in DIFFERENTIABLE:
            return self._output_derivatives(output, x)
        if output != PEAK_TO_PEAK:
            known = (*self.exact, *self.differentiable)
            raise UnknownNameError.among(f"derivatives of {self.name}", "output", output, known)
        found = self.kernel.with_derivatives(x)
        return SettingDerivatives(
            evaluation=found.evaluation,
            by_column=found.by_column,
            by_setting=found.by_modification[:, : len(self._amounts)] @ self._modification_by_clearance * MICROMETRE,
        )

    def _combined_derivatives(self, combined: OverLoadCases, x: Samples) -> SettingDerivatives:
        """Return the derivatives of what is made of an output under several load cases."""
        parts = [self.derivatives(name, x) for name in combined.of]
        values = np.hstack([part.evaluation.values for part in parts])
        weights = combined.weights(values)
        by_column = sum(weights[:, [at]] * part.by_column for at, part in enumerate(parts))
        by_setting = sum(weights[:, [at]] * part.by_setting for at, part in enumerate(parts))
        status = np.max([part.evaluation.status for part in parts], axis=0)
        return SettingDerivatives(
            evaluation=Evaluation(values=(weights * values).sum(axis=1, keepdims=True), status=np.asarray(status)),
            by_column=np.asarray(by_column),
            by_setting=np.asarray(by_setting),
        )

    def _output_derivatives(self, output: str, x: Samples) -> SettingDerivatives:
        evaluation, slopes = output_derivatives(self.kernel, output, x)
        columns = self.kernel.model.columns
        varied, amounts = ([columns.index(name) for name in names] for names in (self.columns, self._amounts))
        return SettingDerivatives(
            evaluation=evaluation,
            by_column=slopes[:, varied],
            by_setting=slopes[:, amounts] @ self._modification_by_clearance * MICROMETRE,
        )

    def observed(self, observe: Observer) -> ReducerModel:
        """Return the model whose kernel tells someone the statuses of each chunk."""
        return replace(self, kernel=replace(self.kernel, observe=observe))

    def mapped(self, mapper: Mapper) -> ReducerModel:
        """Return the model whose kernel has its chunks solved by a mapper."""
        return replace(self, kernel=replace(self.kernel, mapper=mapper))

    def release(self) -> None:
        """Let go of the kernel's tables."""
        self.kernel.release()

    @property
    def conditions(self) -> Mapping[str, float | str]:
        """Torque on the carrier, and the temperature of the discs where it is not that of the ring."""
        warmer = self.kernel.disc_temperature
        return {TORQUE: self.kernel.torque, **({DISC_TEMPERATURE: warmer} if warmer else {})}

    @property
    def operating_conditions(self) -> tuple[Setting, ...]:
        """The torque up to twice the rated one, the temperature of the discs above the ring, or as far as they are."""
        torque, warmer, rated = self.kernel.torque, self.kernel.disc_temperature, self.reducer.load.rated_torque
        most, warmest = max(2 * rated, abs(torque)), max(_WIDEST_TEMPERATURE, abs(warmer))
        return (
            Setting(name=TORQUE, value=torque, lower=-most, upper=most, step=rated / 100),
            Setting(name=DISC_TEMPERATURE, value=warmer, lower=-warmest, upper=warmest, step=0.1),
        )

    @cached_property
    def exact_loop_in_force(self) -> HysteresisLoop:
        """Torque against twist of the unit of mean parts whose teeth have the modification in force."""
        return hysteresis_loop(self.kernel.model, self.mean_unit, TURN_ANGLES)

    @property
    def mean_unit(self) -> Float[np.ndarray, "1 all_columns"]:
        """Errors of the unit whose parts lie in the middle of their zones [m, angles rad]."""
        return self.kernel.errors(np.array([self.middles or np.zeros(len(self.columns))]))

    @property
    def drawn_amounts(self) -> DrawnAmounts:
        """Equidistant, shift and, as an arc at r_d, rotation amount of the modification, in steps of 0.5 µm.

        A rotation that is locked stays as it is, whatever its step. Zones of the first two stand beside them, that of
        the rotation in a frame of its own, because it holds at a radius that its row states.
        """
        names, convention = ["equidistant Δr_rp [µm]", "shift Δr_p [µm]"], MODIFICATION_CONVENTION
        radius, locked = self.reducer.cycloid_stage.disc_pitch_radius, 0.0
        if len(self._amounts) > len(names):
            names, turned = [*names, "rotation δ·r_d [µm]"], self.settings[0]
            locked = abs(turned.value) if turned.lower == turned.upper else 0.0
            convention = f"{convention}; {ROTATION_CONVENTION.format(radius=radius / MILLIMETRE)}"
        count, lever = len(names), np.array([[1.0], [1.0], [radius]])
        return DrawnAmounts(
            names=tuple(names),
            by_setting=lever[:count] * self._modification_by_clearance,
            steps=(0.5, 0.5, locked or 0.5)[:count],
            finest=(0.1, 0.1, locked or 0.1)[:count],
            convention=convention,
            sources=self._amounts[:2],
        )

    @property
    def content(self) -> Any:
        """Reducer, identified stiffnesses, torque, and form, crowning and temperatures of parts where there are any."""
        form = [own for own in (self.reducer.form, self.reducer.cycloid_stage.crowning) if own]
        further = (self.kernel.disc_temperature, self.load_cases)
        identified = self.identified.content if self.identified else None
        return (self.reducer, identified, self.kernel.torque, *form, *(further if any(further) else ()))

    @property
    def uncertain(self) -> tuple[CorrelatedSource, ...]:
        """What is not known of identified stiffnesses."""
        return (stiffness_source(self.identified, self.reducer),) if self.identified else ()

    @property
    def with_assumed(self) -> ReducerModel:
        """The model with its bearings' stiffnesses among what is uncertain, by no amount unless identified."""
        own = {name: getattr(self.reducer.stiffness, name) for name in family_of(self.reducer).identified}
        values = {name: value for name, value in own.items() if np.isfinite(value)}
        if self.identified or not values:
            return self
        known = dict.fromkeys(values, 0.0)
        assumed = IdentifiedStiffness(source=self.reducer.name, values=values, standard_uncertainty=known)
        return replace(self, identified=assumed)

    def with_uncertain(self, outputs: tuple[str, ...]) -> Response:
        """Return the response of the outputs with the stiffnesses as further columns, to first order in ln K."""
        if self.identified is None:
            return self.reading(outputs)
        peak = self._peak_with_stiffness
        if outputs == peak.outputs:
            return peak
        axes = principal_axes(self.identified.covariance)
        return OutputsWithStiffness(peak=peak, outputs=outputs, reading=self._reading_on, axes=axes)

    def changed(self, change: Float[np.ndarray, " uncertain_column"]) -> ReducerModel:
        """Return the model of the reducer whose identified stiffnesses are changed, by ln K/K0 [-]."""
        return replace(self, kernel=self._peak_with_stiffness.changed(change))

    @property
    def accuracy(self) -> Mapping[str, float]:
        """That of the peak-to-peak, from the angles of its search [arcsec]."""
        return dict.fromkeys(self._everywhere((PEAK_TO_PEAK,)), SEEN)

    rests_on = ""
    """Its bounds take nothing for true beside the model."""

    def unbounded(self, output: str) -> str:
        """Return why nothing is certain of an output: bounds are known of the peak-to-peak without play and tilt."""
        if output != PEAK_TO_PEAK:
            return f"only the peak-to-peak of a reducer has one, and the limit is one of {output}"
        standing = (name for name, value in self.kernel.fixed.items() if value)
        tilted = any(name.startswith("disc") and ".tilt" in name for name in (*self.columns, *standing))
        if tilted and self.kernel.model.design.law == LINEAR:
            return "discs of this drawing tilt, which moves contacts by no linear law"
        layout = self.kernel.model.error_columns.layout
        return "elements of the reducer have play" if layout.flank > layout.clearance else ""

    def unit_bounds(
        self,
        output: str,
        units: ScaledUnits,
        designs: Float[np.ndarray, "design variable"],
    ) -> PeakBounds:
        """Return what is certain of the peak-to-peak of random units, by the angles of some designs."""
        if reason := self.unbounded(output):
            raise ValueError(reason)
        from tolalloc.reducers.equivalent.peak_bounds import PeakBounds

        own = self.kernel
        return PeakBounds.of(
            own.model, own.torque, units, designs, lambda x, at: (self.at(at) if at.size else self).kernel.errors(x)
        )

    @property
    def _peak_with_stiffness(self) -> StiffnessResponse:
        stiffnesses = tuple(self.identified.values) if self.identified else ()
        return StiffnessResponse(kernel=self.kernel, stiffnesses=stiffnesses)

    def _reading_on(self, kernel: KernelResponse, outputs: tuple[str, ...]) -> Response:
        """Return the response of the outputs on a kernel with other stiffnesses."""
        return replace(self, kernel=kernel).reading(outputs)

    @cached_property
    def spectra(self) -> Mapping[float, tuple[str, str]]:
        """Waves of the output turn that the curves' angles hold: 1, 2, multiples of teeth and pins, those of gears."""
        stage, angles = self.reducer.cycloid_stage, self.kernel.model.search.coarse
        multiples = {number * own for number in range(1, _MULTIPLES + 1) for own in (stage.disc_teeth, stage.pin_count)}
        # One turn does not part waves that lie closer than a quarter of one.
        own_waves = (own for own in self.reducer.open_orders if min(abs(own - whole) for whole in multiples) > 0.25)
        gears = {round(own, 3) for own in own_waves}
        own = sorted({1, 2, *multiples, *gears})
        return {order: wave_outputs(order) for order in own if self.reducer.resolves(order, angles)}

    def stand_ins(self) -> tuple[Any, ...]:
        """Return the contact at fewer angles and, for few columns, a regression of the curve."""
        from tolalloc.reducers.surrogates import ContactCandidate, CurveCandidate

        contact = tuple(ContactCandidate(kernel=self.kernel, angles=angles) for angles in _ANGLES)
        return contact if len(self.columns) > _MOST_COLUMNS else (*contact, CurveCandidate(kernel=self.kernel))

    @cached_property
    def own_limits(self) -> Mapping[str, float]:
        """No pin may press harder without torque than the rated torque makes it: such a unit is preloaded.

        Not with an RV reducer's printed stiffnesses, which no dimensions support: far too large, they press nearly all.
        With either the pins' friction may take no more without load than the catalogue allows, where it states that:
        less what seals, grease and preloaded rollers take.
        """
        pressed = self.reducer.parts or self.reducer.is_dimensioned
        limits = {PRELOAD: self.rated_pin_force} if pressed else {}
        catalogue = self.reducer.catalogue
        if catalogue and catalogue.no_load_torque:
            limits[FRICTION_TORQUE] = catalogue.no_load_torque - IdleTorque.of(self.reducer).together
        return limits

    @cached_property
    def rated_pin_force(self) -> float:
        """Largest pin force of exact parts with the modification in force under their rated torque [N]."""
        return rated_pin_force(self.reducer_in_force)

    def examined(self, x: Samples) -> Mapping[str, float]:
        """Return how many random units are preloaded or have no radial clearance, by how much, and what turns them."""
        found, rated = preload(self.kernel.model, self.kernel.errors(x)), self.rated_pin_force
        solved = found.status == 0
        counted = {"units [-]": len(x), "units in equilibrium [-]": int(solved.sum())}
        if not solved.any():
            return counted
        left = self.reading((RADIAL_CLEARANCE,))(x)
        radial = left.values[left.good, 0]
        return counted | {
            "share preloaded [-]": float((found.pin_force[solved] > rated).mean()),
            "pin force of the rated torque [N]": rated,
            "share without radial clearance [-]": float((radial < 0).mean()),
            "least radial clearance [µm]": float(radial.min()),
            "median pin force without torque [N]": float(np.median(found.pin_force[solved])),
            "no-load torque of the pins, median [N·m]": float(np.median(found.friction_torque[solved])),
            "no-load torque of the pins, 99.73 % [N·m]": float(np.quantile(found.friction_torque[solved], _NEARLY_ALL)),
        }
