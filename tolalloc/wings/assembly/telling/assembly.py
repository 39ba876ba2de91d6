"""What is said of an assembly: what is turned at every step, what that leaves and does, and what tolerances cost."""

from __future__ import annotations

from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import ARCSECOND, DEGREE, MILLIMETRE
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.wings.assembly.adjustment import AdjustedParts, AngularTolerances, AssemblyResult
from tolalloc.wings.assembly.orientations import TransmissionEffect
from tolalloc.wings.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.wings.assembly.steps import AssemblyStep, adjustable, efforts
from tolalloc.wings.assembly.telling import tables
from tolalloc.wings.assembly.telling.tables import at_state_weight, has_limits, norm_of
from tolalloc.wings.assembly.telling.tolerances import (
    certificate_table,
    cost_sentences,
    is_priced,
    limit_table,
    limited_tolerances,
    tolerance_section,
    tolerance_table,
    tolerance_warnings,
    verified_name,
)
from tolalloc.wings.assembly.telling.transmission import (
    difference_table,
    fallen_table,
    transmission_section,
    transmission_sentences,
    transmission_warnings,
    value_table,
)

if TYPE_CHECKING:
    import pandas as pd

LITTLE = 0.01
"""Share of all final angles below which another unit of precision buys little [-]."""
_SAME = 1e-6
"""Share by which totals may differ by rounding [-]."""
_say = Sentences("assembly", "tolalloc.wings.assembly")


class AssemblyTeller(Teller[AssemblyResult]):
    """What is said of one assembly."""

    @property
    def title(self) -> str:
        """What is assembled."""
        return _say("title", name=self.result.plan.name)

    @property
    def subtitle(self) -> str:
        """How many parts on which datum, at which precision, and which parts."""
        plan, measured = self.result.plan, self.result.measured
        return _say(
            "subtitle",
            parts=len(plan.chain.names),
            datum=plan.chain.datum,
            precision=plan.state_weight,
            which=measured.name if measured else _say("within"),
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """What adjusting is worth, each sentence no stronger than what was computed."""
        own, effect = self.result, self.result.transmission
        tolerances = limited_tolerances(own)
        return (
            self._worth,
            self._diminishing,
            *(transmission_sentences(effect, own.plan.state_weight) if effect else ()),
            *(cost_sentences(own.plan, tolerances) if tolerances else ()),
        )

    @property
    def _worth(self) -> str:
        """What adjusting takes off all final angles, measured or to be expected."""
        own, at = self.result, at_state_weight(self.result)
        if own.measured:
            before, after = own.measured.norms[[0, at]] / ARCSECOND
            name, precision = own.measured.name, own.plan.state_weight
            return _say("norm", name=name, precision=precision, norm=norm_of(own), before=before, after=after)
        before, after, floor = np.array([own.sweep.total[0], own.sweep.total[at], own.sweep.noise_floor]) / ARCSECOND
        return _say("expected", before=before, after=after, precision=own.plan.state_weight, floor=floor)

    @property
    def _diminishing(self) -> str:
        """Where another unit of precision buys little, and where it makes things worse."""
        sweep, found = self.result.sweep, self.result.sweep.diminished(LITTLE)
        floor = _say("floor", floor=sweep.noise_floor / ARCSECOND) if self.result.measured else ""
        if found is None:
            return _say("not_diminished", largest=sweep.state_weights[-1], share=sweep.next_unit[-1], floor=floor)
        adding = sweep.state_weights[(sweep.state_weights >= found) & (sweep.next_unit < 0)]
        adds = _say("adds", precision=adding[0]) if adding.size else ""
        return _say("diminished", found=found, little=LITTLE, adds=adds, floor=floor)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        own, effect = self.result, self.result.transmission
        rose, tolerances = tables.larger(own), limited_tolerances(own)
        unlimited = own.plan.requirements is not None and not has_limits(own)
        return (
            *self._not_there,
            *self._beyond,
            *self._missed,
            *((_say("warn_larger", angles=", ".join(rose)),) if rose else ()),
            *self._fewer,
            *(transmission_warnings(effect, own.plan.state_weight) if effect else ()),
            *((_say("warn_unlimited"),) if unlimited else ()),
            *((_say("warn_unreachable", why=own.unreachable),) if own.unreachable else ()),
            *(tolerance_warnings(tolerances) if tolerances else ()),
        )

    @property
    def _not_there(self) -> tuple[str, ...]:
        """Which steps turn parts that are mounted later."""
        mounted, steps = set[str](), list[str]()
        for number, step in enumerate(self.result.plan.steps, start=1):
            mounted.add(step.mount)
            steps += [str(number)] if set(step.adjust) - mounted else []
        return (_say("warn_not_there", steps=", ".join(steps)),) if steps else ()

    @property
    def _beyond(self) -> tuple[str, ...]:
        """Which measured errors are larger than their tolerance."""
        if self.result.measured is None:
            return ()
        errors, tolerances = self.result.measured.errors, self.result.plan.tolerances
        # Both come from decimals of an arcsecond; an error equal to its tolerance is not beyond it.
        beyond = np.abs(errors) > tolerances * (1 + 1e-12)
        found = [
            _say(
                "beyond",
                part=name,
                axis="xyz"[axis],
                error=errors[at, axis] / ARCSECOND,
                tolerance=tolerances[at, axis] / ARCSECOND,
            )
            for (at, name), axis in product(enumerate(self.result.plan.chain.names), range(3))
            if beyond[at, axis]
        ]
        return (_say("warn_beyond", parts=", ".join(found)),) if found else ()

    @property
    def _missed(self) -> tuple[str, ...]:
        """Which limits are not kept, by the measured parts or by the stated tolerances, and what would keep them."""
        if not has_limits(self.result):
            return ()
        measured, rows = self.result.measured, tables.characteristics(self.result)
        key = "limited_measured" if measured else "limited"

        def limited(word: str) -> str:
            found = [row for row in rows if row.kept(measured=measured is not None) == word]
            return ", ".join(_say(key, **vars(row) | {"after": abs(row.after), "missed": row.noise}) for row in found)

        missed, doubted = limited("no"), limited("in doubt")
        by, remedy = _say("by_measured" if measured else "by_expected"), ""
        if measured:
            keeping = measured.keeping
            remedy = f" {_say('never_keeping') if keeping is None else _say('keeping', precision=keeping)}"
        return (
            *((_say("warn_missed", by=by, missed=missed, remedy=remedy),) if missed else ()),
            *((_say("warn_doubted", doubted=doubted),) if doubted else ()),
        )

    @property
    def _fewer(self) -> tuple[str, ...]:
        """Whether it is better to leave alone what was adjusted before."""
        fewer, total = self.result.fewer, self.result.sweep.total[at_state_weight(self.result)]
        if fewer is None or fewer >= total * (1 - _SAME):
            return ()
        noise = self.result.plan.adjustment_noise / ARCSECOND
        key = "warn_fewer_noise" if noise else "warn_fewer"
        return (_say(key, fewer=fewer / ARCSECOND, total=total / ARCSECOND, noise=noise),)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        own = self.result
        return (
            *self.header.assumptions,
            _say("assume_small"),
            _say("assume_normal"),
            _say("assume_regulator"),
            *((_say("assume_measured"),) if own.measured else ()),
            *((_say("assume_gains"),) if limited_tolerances(own) else ()),
            *((_say("assume_angles_alone"),) if own.transmission else ()),
        )

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Steps, precision, transmission, tolerances, finite rotations."""
        own, effect, measured = self.result, self.result.transmission, self.result.measured
        tolerances, precision = limited_tolerances(own), own.plan.state_weight
        found = [self._steps, self._sweep]
        if effect:
            found.append(transmission_section(effect, precision, measured=measured is not None))
        if tolerances:
            found.append(tolerance_section(own.plan, tolerances))
        if measured:
            said = _say("section_finite", name=measured.name, difference=measured.finite_difference / ARCSECOND)
            found.append(Section(heading=_say("finite_heading"), paragraphs=(said,)))
        return tuple(found)

    @property
    def _steps(self) -> Section:
        """How errors build up and are adjusted."""
        own, measured = self.result, self.result.measured
        first = _say("section_steps", measured="" if measured else "then measured, ", datum=own.plan.chain.datum)
        known = (_say("section_measured"), *self._larger_angles(measured)) if measured else (_say("section_expected"),)
        return Section(
            heading=_say("steps_heading"),
            paragraphs=(first, *known),
            figures=self._step_figures,
            tables=(
                ("steps", self._step_frame),
                ("characteristics", self.characteristics),
                *((("angles", tables.angle_table(own, measured)),) if measured else ()),
                ("gains", tables.gain_table(own)),
            ),
        )

    def _larger_angles(self, measured: AdjustedParts) -> tuple[str, ...]:
        """Return how many single angles adjusting leaves larger."""
        before, after = measured.unadjusted / ARCSECOND, measured.adjusted / ARCSECOND
        rose, names = np.argwhere(np.abs(after) > np.abs(before)), self.result.plan.chain.names
        if not rose.size:
            return ()
        named = ", ".join(
            _say("larger_angle", part=names[at], axis="xyz"[axis], before=before[at, axis], after=after[at, axis])
            for at, axis in rose
        )
        return (_say("section_larger", norm=norm_of(self.result), rose=len(rose), angles=before.size, named=named),)

    @property
    def _sweep(self) -> Section:
        """What a larger precision buys."""
        own, rose = self.result, tables.larger(self.result)
        said = _say(
            "section_sweep",
            bought=self._bought,
            rose=len(rose) or "none",
            all=2 * len(own.plan.chain.names),
            are="is" if len(rose) == 1 else "are",
            precision=own.plan.state_weight,
        )
        return Section(
            heading=_say("sweep_heading"),
            paragraphs=(said,),
            figures=self._sweep_figures,
            tables=(("sweep", tables.sweep_table(own)),),
        )

    @property
    def _bought(self) -> str:
        """What a larger precision does to all angles together, as far as the sweep shows."""
        sweep = self.result.sweep
        least = int(np.argmin(sweep.total))
        if (np.diff(sweep.total) <= 0).all() and sweep.total[least] < sweep.total[0]:
            return _say("bought", each=_say("each_less") if (np.diff(sweep.next_unit) <= 0).all() else "")
        return _say("bought_least", precision=sweep.state_weights[least], least=sweep.total[least] / ARCSECOND)

    @cached_property
    def characteristics(self) -> pd.DataFrame:
        """Tilt and rotation of every characteristic before and after adjusting."""
        return tables.characteristic_table(self.result)

    @cached_property
    def _step_frame(self) -> pd.DataFrame:
        return tables.step_table(self.result)

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Every step, and what it leaves in the end."""
        own, listed, steps = self.result, self._step_frame, []
        said = [name for name in ("step [-]", "mount", "measure") if name in listed]
        for (step, *done), rows in listed.groupby(said, sort=False):
            work = ", ".join(f"{verb} {what}" for verb, what in zip(said[1:], done, strict=True))
            steps.append((rows.drop(columns=said), _say("terminal_step", step=step, work=work)))
        name = own.measured.name if own.measured else own.plan.name
        final = _say("terminal_final", name=name, datum=own.plan.chain.datum)
        return (*steps, (self.characteristics, final))

    @property
    def _step_figures(self) -> tuple[Figure, ...]:
        """Tilt and rotation of every characteristic from the step that mounts it."""
        kind, plan = "" if self.result.measured else ", three standard deviations", self.result.plan
        mounted = [step.mount for step in plan.steps]
        where, figures = np.arange(1, len(mounted) + 1)[:, np.newaxis] + [0.0, 0.5], []
        angles = zip(("tilt", "rotation"), tables.tilt_and_rotation(tables.states(self.result)), strict=True)
        for name, values in angles:
            lines = []
            for at, part in enumerate(plan.chain.names):
                there = slice(mounted.index(part), None)
                lines.append(Series.line(part, where[there].ravel(), values[there, :, at].ravel() / ARCSECOND))
            title, y_label = _say("steps_figure", angle=name.capitalize()), f"{name}{kind} [arcsec]"
            figures.append(Figure(name=name, title=title, x_label="step [-]", y_label=y_label, series=tuple(lines)))
        return tuple(figures)

    @property
    def _sweep_figures(self) -> tuple[Figure, Figure]:
        """What is left over the precision, and against the effort."""
        own, sweep = self.result, self.result.sweep
        total, floor = sweep.total / ARCSECOND, (sweep.noise_floor / ARCSECOND, "")
        turned = sweep.state_weights > 0
        x = sweep.state_weights[turned]
        series = [Series.line("to be expected of all angles, rms", x, total[turned])]
        if own.measured:
            name, norms = f"{norm_of(own)} of {own.measured.name}", own.measured.norms[turned] / ARCSECOND
            series.append(Series.line(name, x, norms))
        asked = own.plan.state_weight
        if asked > 0:  # 0 has no place on a logarithmic axis
            series.append(Series.points(f"at Q = {asked:g}", [asked], [total[at_state_weight(own)]]))
        effort = Series.line("to be expected", sweep.effort / ARCSECOND**2, total)
        return (
            Figure(
                name="precision",
                title=_say("precision_figure"),
                x_label=tables.PRECISION,
                y_label="all final angles together [arcsec]",
                series=tuple(series),
                horizontal=(floor,),
                logarithmic_x=True,
            ),
            Figure(
                name="effort",
                title=_say("effort_figure"),
                x_label="expected effort, Σ uᵀRu [arcsec²]",
                y_label="all final angles together, rms [arcsec]",
                series=(effort,),
                horizontal=(floor,),
            ),
        )

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units in the names."""
        own, plan, sweep = self.result, self.result.plan, self.result.sweep
        at, tolerances, effect = at_state_weight(own), limited_tolerances(own), own.transmission
        return {
            "assembly": plan.name,
            "source": plan.source,
            "reducer": effect.reducer.name if effect else None,
            "precision [-]": plan.state_weight,
            "seed": self.header.seed,
            "plan": plan_record(plan),
            "expected rms unadjusted [arcsec]": plain(sweep.total[0], ARCSECOND),
            "expected rms adjusted [arcsec]": plain(sweep.total[at], ARCSECOND),
            "left however large the precision [arcsec]": plain(sweep.noise_floor, ARCSECOND),
            "turning only what was just mounted, rms [arcsec]": (
                None if own.fewer is None else plain(own.fewer, ARCSECOND)
            ),
            "expected effort [arcsec²]": plain(sweep.effort[at], ARCSECOND**2),
            "diminished from precision [-]": sweep.diminished(),
            "measured": _measured_record(own, own.measured) if own.measured else None,
            "steps": _records(self._step_frame),
            "characteristics": _records(self.characteristics),
            "sweep": _records(tables.sweep_table(own)),
            "transmission": _transmission_record(effect) if effect else None,
            "tolerances": _tolerances_record(plan, tolerances) if tolerances else None,
            "warnings": list(self.warnings),
        }


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a table's rows; what is not there is null, as JSON has no other word for it."""
    rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
    return [{str(name): value for name, value in row.items()} for row in rows]


def _measured_record(result: AssemblyResult, measured: AdjustedParts) -> dict[str, Any]:
    before, after = plain(measured.norms[[0, at_state_weight(result)]], ARCSECOND)
    keeping = measured.keeping and plain(measured.keeping)
    return {
        "name": measured.name,
        f"{norm_of(result)} unadjusted [arcsec]": before,
        f"{norm_of(result)} adjusted [arcsec]": after,
        "largest difference by finite rotations [arcsec]": plain(measured.finite_difference / ARCSECOND),
        **({"smallest precision tried that keeps all limits [-]": keeping} if has_limits(result) else {}),
        "angles": _records(tables.angle_table(result, measured)),
    }


def _transmission_record(effect: TransmissionEffect) -> dict[str, Any]:
    fallen = fallen_table(effect)
    return {
        "assemblies [-]": int(effect.good.size),
        "failed [-]": int((~effect.good).sum()),
        "values": _records(value_table(effect)),
        "above exact parts": _records(difference_table(effect)),
        "smaller than unadjusted": [] if fallen is None else _records(fallen),
    }


def _tolerances_record(plan: AssemblyPlan, tolerances: AngularTolerances) -> dict[str, Any]:
    verified, unadjusted = tolerances.verification, tolerances.unadjusted
    return {
        "cost unadjusted [cost units]": None if isinstance(unadjusted, str) else plain(unadjusted.total),
        "cost adjusted [cost units]": plain(tolerances.adjusted.total),
        "lower bound adjusted [cost units]": plain(tolerances.adjusted.bound),
        "cost re-tuned [cost units]": plain(tolerances.retuned.best.total),
        "re-tuning settled": tolerances.retuned.settled,
        "best precision [-]": plain(tolerances.by_state_weight.best.gains.state_weight) if is_priced(plan) else None,
        "verified": verified_name(plan, tolerances),
        "assemblies [-]": verified.assemblies,
        "within all limits [-]": verified.share.estimate,
        "low 2.5 % [-]": verified.share.low,
        "high 97.5 % [-]": verified.share.high,
        "parts": _records(tolerance_table(plan, tolerances)),
        "limits": _records(limit_table(plan, tolerances)),
        "certificates": _records(certificate_table(plan, tolerances)),
    }


def plan_record(plan: AssemblyPlan) -> dict[str, Any]:
    """Return the whole plan."""
    required = plan.requirements
    return {
        "name": plan.name,
        "source": plan.source,
        "reducer": plan.reducer or None,
        "datum": plan.chain.datum,
        "precision [-]": plan.state_weight,
        "measurement noise, σ [arcsec]": plain(plan.measurement_noise, ARCSECOND),
        "adjustment noise, σ [arcsec]": plain(plan.adjustment_noise, ARCSECOND),
        "parts": [_part(plan, at) for at in range(len(plan.chain.parts))],
        "steps": [_step(plan, number, step) for number, step in enumerate(plan.steps, start=1)],
        "tolerances": None if required is None else _tolerances_asked(required),
        "assumptions": list(plan.assumptions),
    }


def plain(values: float | Float[np.ndarray, "*shape"], unit: float = 1.0) -> Any:
    """Return numbers [SI] in a unit [SI] for JSON, without digits that mean nothing; what is infinite is not stated."""
    found = np.round(np.asarray(values) / unit, 6) + 0.0
    stated = np.asarray(found, dtype=object)
    stated[~np.isfinite(found)] = None
    return stated.tolist()


def _part(plan: AssemblyPlan, at: int) -> dict[str, Any]:
    part, required = plan.chain.parts[at], plan.requirements
    return {
        "part": part.name,
        "on": part.on,
        "turned [deg]": plain(np.array(part.turned), DEGREE),
        "position [mm]": plain(np.array(part.position), MILLIMETRE),
        "tilts": list(part.tilts),
        "rotates": list(part.rotates),
        "tolerance, ± [arcsec]": plain(plan.tolerances[at], ARCSECOND),
        "weight [-]": plain(plan.weights[at]),
        **({} if required is None else _limits_and_costs(required, at)),
    }


def _limits_and_costs(required: AngularRequirements, at: int) -> dict[str, Any]:
    reciprocal = required.form == "reciprocal"
    unit, name = (ARCSECOND, "cost units·arcsec") if reciprocal else (1.0, "cost units")
    return {
        "tilt limit, 3σ [arcsec]": plain(required.tilt_limit[at], ARCSECOND),
        "rotation limit, 3σ [arcsec]": plain(required.rotation_limit[at], ARCSECOND),
        f"cost factor [{name}]": plain(required.factor[at], unit),
        "cost fixed [cost units]": plain(required.fixed[at]),
        **({} if reciprocal else {"cost scale [arcsec]": plain(required.scale[at], ARCSECOND)}),
    }


def _step(plan: AssemblyPlan, number: int, step: AssemblyStep) -> dict[str, Any]:
    turned = zip(plan.chain.names, adjustable(plan.chain, step), plain(efforts(plan.chain, step)), strict=True)
    return {
        "step [-]": number,
        "mount": step.mount,
        "effort of what may be turned [-]": {name: effort for name, may, effort in turned if may},
        "measure": list(step.measure),
    }


def _tolerances_asked(required: AngularRequirements) -> dict[str, Any]:
    return {
        "smallest [arcsec]": plain(required.smallest, ARCSECOND),
        "largest [arcsec]": plain(required.largest, ARCSECOND),
        "cost form": required.form,
        "effort price [cost units/arcsec²]": plain(required.effort_price, 1 / ARCSECOND**2),
    }
