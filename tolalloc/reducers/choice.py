"""Which reducer a study asks, ``ta.reducer``, and how it is bound to the sources of a drawing."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import neglected_columns
from tolalloc.drawings.tolerance_table import require_small_zones
from tolalloc.exceptions import InputError
from tolalloc.models.settings import require_settings
from tolalloc.reading.files import found_from_here
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reducers import DISC_TEMPERATURE, TORQUE
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel, cached_model
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.equivalent.springs import HARMONICS
from tolalloc.reducers.families.known import SOURCES
from tolalloc.reducers.load_case import LoadCase, load_cycle, require_load_cases
from tolalloc.reducers.reducer.design import Modification, Reducer, at_torque
from tolalloc.reducers.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.reducers.settings import TEMPERATURE, Ranges, clearance_settings, is_range
from tolalloc.reducers.unit_file import BuiltUnit, load_unit

if TYPE_CHECKING:
    from tolalloc.reducers.model import ReducerModel


NEGLECTED = SOURCES.neglected
"""Sources that a tolerance table need not list; they are then taken as exact, and the report says so."""

_NOMINAL = "*.clearance"
"""Sources of clearances: one without a row has the nominal value of the reducer file, whatever else is neglected."""

_LARGEST_ZONE = 200.0 * MICROMETRE
"""Largest zone of a reducer's part that is believed; a metre typed for a millimetre is far above it [m]."""
_LARGEST_MISMATCH = 0.01
"""Largest share by which a nominal size of a table may differ from that of the reducer without a remark [-]."""
_FARTHEST = 50.0
"""Largest clearance that a modification may be asked to leave, either way [µm]."""


def bind(
    reducer: Reducer,
    errors: ErrorModel,
    torque: float | None,
    place: str,
    neglected: Sequence[str] = (),
    unit: BuiltUnit | None = None,
) -> tuple[KernelResponse, tuple[str, ...]]:
    """Return the equivalent model at the sources of a drawing, and what the binding assumes; nothing is solved.

    The model stands at the reducer's own modification and has the orders of the unit that is to be shown, if any; the
    arguments are those of `ReducerChoice`, and the place is who asks, for messages.
    """
    require_small_zones(errors.sources, _LARGEST_ZONE, place)
    orders = tuple(sorted({*errors.orders, *(unit.orders if unit else ())}))
    carried = reducer.torque_on_carrier(torque, place)
    # The next question of the same reducer finds the tables as they are.
    model = cached_model(at_torque(reducer, carried), AngleSearch(), orders or HARMONICS)
    listed = {*errors.columns, *errors.fixed, *reducer.modification.deviations}
    rest = [name for name in model.columns if name not in listed]
    own, usual = neglected_columns(neglected, rest), dict.fromkeys((*NEGLECTED, _NOMINAL))
    fixed: Mapping[str, float] = {
        **dict.fromkeys(neglected_columns((*neglected, *usual), rest), 0.0),
        **dict.fromkeys(_absent_orders(errors, model, place), 0.0),
        **errors.fixed,
        **reducer.modification.deviations,
    }
    kernel = KernelResponse(
        model=model,
        torque=carried,
        columns=errors.columns,
        fixed=dict(sorted(fixed.items())),  # in one order in every process, as kept units ask for
        offsets={name: errors.fixed[name] for name in reducer.modification.deviations if errors.fixed.get(name)},
    )
    if unit:
        unit.require_no_form(place)
        unit.errors(model.columns, reducer.modification.deviations)
    # Amounts of the modification without a row are as the reducer file has them, whatever is neglected.
    amounts = [name for name in reducer.modification.deviations if name not in {*errors.columns, *errors.fixed}]
    taken = [_taken(pattern, [*rest, *amounts]) for pattern in dict.fromkeys(neglected)]
    exact = ", ".join([*taken, *(pattern for pattern in usual if neglected_columns((pattern,), rest) - own)])
    return kernel, ((f"not in the tolerance table and taken as exact: {exact}",) if exact else ())


def _taken(pattern: str, columns: Sequence[str]) -> str:
    """Return a pattern of a user's own with the sources that it took, those that differ by their numbers as one."""
    taken = neglected_columns((pattern,), columns)
    names = ", ".join(dict.fromkeys(re.sub("[0-9]+", "*", source_name(own)) for own in columns if own in taken))
    return pattern if names == pattern else f"{pattern} ({names or 'which takes none'})"


def _absent_orders(errors: ErrorModel, model: EquivalentModel, place: str) -> list[str]:
    """Return the columns of listed sources whose orders their spectra do not have."""
    own = {source.name: list[str]() for source in errors.sources}
    for column in model.columns:
        own.get(source_name(column), []).append(column)
    _require_each(errors, own, model.reducer, place)
    return [
        column for source in errors.sources for column in own[source.name] if column not in frozenset(source.columns)
    ]


def _require_each(errors: ErrorModel, own: Mapping[str, Sequence[str]], reducer: Reducer, place: str) -> None:
    """Raise unless every source has as many like features as its columns say, one line for all that have not."""
    wrong: dict[tuple[int, int, str], list[str]] = {}
    for source in errors.sources:
        kind = SOURCES.of(source.name)
        if own[source.name] and kind and source.each != kind.count(reducer):
            wrong.setdefault((source.each, kind.count(reducer), kind.each or ""), []).append(source.name)
    if not wrong:
        return
    said = (
        f"each is {each} in {', '.join(names)}; allowed is {count}{f', one for each {what}' if what else ''}"
        for (each, count, what), names in wrong.items()
    )
    raise InputError(f"{place}, tolerance table {errors.table}".strip() + f": {'; '.join(said)}.")


def _other_sizes(errors: ErrorModel, reducer: Reducer) -> tuple[str, ...]:
    """Return which nominal sizes of a table are not those of the reducer, in sentences; a size of 0 is not stated."""
    sentences = []
    for source in errors.sources:
        kind = SOURCES.of(source.name)
        if kind is None or kind.nominal is None or not source.nominal:
            continue
        what, size = kind.nominal.said, kind.nominal.of(reducer)
        if abs(source.nominal - size) > _LARGEST_MISMATCH * abs(size):
            sentences.append(
                f"The table and the reducer differ: nominal of {source.name} is {source.nominal / MILLIMETRE:g} mm in "
                f"{errors.table or 'the table'}, and {what} is {size / MILLIMETRE:g} mm in reducer {reducer.name}; the "
                "model takes the reducer's, so correct the one that is wrong."
            )
    return tuple(sentences)


@dataclass(frozen=True, kw_only=True, repr=False)
class ReducerChoice:
    """A reducer as a study names it; it becomes a `tolalloc.reducers.model.ReducerModel` with the study's drawing."""

    reducer: Reducer  # The reducer with the stiffness in use
    identified: IdentifiedStiffness | None = None  # Identified stiffnesses that replaced its own, if any
    ranges: Ranges = (None, None, None)  # Of the clearances [µm]
    # As in `tolalloc.reducer` [N·m, K]
    torque: float | None = None
    disc_temperature: float = 0.0
    load_cases: tuple[LoadCase, ...] = ()
    neglected: tuple[str, ...] = ()  # Beside `NEGLECTED`
    unit: BuiltUnit | None = None  # Built unit whose curve is shown, if any

    def __repr__(self) -> str:
        stiffness = f", stiffness of {self.identified.source}" if self.identified else ""
        cranks, discs = self.reducer.crank_count, self.reducer.disc_count
        return f"<reducer {self.name}: {cranks} cranks, {discs} discs{stiffness}>"

    @property
    def name(self) -> str:
        """The reducer's."""
        return self.reducer.name

    @property
    def source_names(self) -> tuple[str, ...]:
        """Names of all sources that the reducer has."""
        return tuple(dict.fromkeys(map(source_name, EquivalentModel(self.reducer).columns)))

    def leaving_out(self, patterns: Sequence[str]) -> ReducerChoice:
        """Return the reducer with other sources that a drawing may leave out, patterns of them, beside its own."""
        return replace(self, neglected=(*self.neglected, *patterns))

    def set_to(self, settings: Mapping[str, float]) -> ReducerChoice:
        """Return the reducer with a modification that leaves other clearances [µm], or other conditions [N·m, K]."""
        place, torque = f"reducer {self.name}", settings.get(TORQUE, self.torque)
        self.reducer.torque_on_carrier(torque, place)
        warmer = settings.get(DISC_TEMPERATURE, self.disc_temperature)
        TEMPERATURE.check(place, DISC_TEMPERATURE, warmer, of_argument=True)
        clearances = {name: value for name, value in settings.items() if name not in (TORQUE, DISC_TEMPERATURE)}
        stage = self.reducer.cycloid_stage
        present = [own / MICROMETRE for own in self.reducer.modification.clearances(stage)]
        # Without a range a clearance is not chosen by an allocation; whoever states one may state any.
        known = clearance_settings(present, (own or (-_FARTHEST, _FARTHEST) for own in self.ranges))
        require_settings(place, known, clearances)
        changed = replace(self, torque=torque, disc_temperature=warmer)
        if not clearances:
            return changed
        turned, flank, radial = (clearances.get(setting.name, setting.value) * MICROMETRE for setting in known)
        modification = Modification.from_clearances(flank, radial, stage, turned)
        return replace(changed, reducer=replace(self.reducer, modification=modification))

    def shared_lines(self, stated: Mapping[str, Hashable]) -> Mapping[str, str]:
        """Return the line of the drawing of every source: discs, cranks, planets, bores and journals are alike."""
        return SOURCES.shared_lines(stated)

    def bound(self, errors: ErrorModel, place: str) -> ReducerModel:
        """Return the model at the sources of a drawing; nothing is solved."""
        from tolalloc.reducers.model import ReducerModel

        kernel, assumptions = bind(self.reducer, errors, self.torque, place, self.neglected, self.unit)
        return ReducerModel(
            kernel=replace(kernel, disc_temperature=self.disc_temperature),
            middles=tuple(errors.middles.tolist()),
            load_cases=self.load_cases,
            ranges=tuple((own[0] * MICROMETRE, own[1] * MICROMETRE) if own else None for own in self.ranges),
            identified=self.identified,
            unit=self.unit,
            left_out=assumptions,
            mismatches=_other_sizes(errors, self.reducer),
        )


def reducer(
    name: str | Path,
    *,
    stiffness: str | Path = "",
    torque: float | None = None,
    flank_clearance: tuple[float, float] | None = None,
    radial_clearance: tuple[float, float] | None = None,
    rotation_clearance: tuple[float, float] | None = None,
    disc_temperature: float = 0.0,
    load_cases: Sequence[LoadCase] | str | Path = (),
    neglected: Sequence[str] = (),
    unit: str | Path = "",
) -> ReducerChoice:
    """Return a reducer for a study, from a preset or a TOML file.

    Parameters
    ----------
    name
        Preset, such as ``rv20e``, or path of a reducer file.
    stiffness
        Identified stiffnesses that replace its own, by shipped name or path.
    torque
        Torque on the carrier, negative where it resists the rotation; the reducer's test torque unless given [N·m].
    flank_clearance, radial_clearance
        Smallest and largest nominal clearance that the tooth modification may leave on the flank, and at tip and root;
        as they are unless given [µm].
    rotation_clearance
        Smallest and largest part of the flank clearance that flanks may leave which are turned towards the middles of
        their teeth, δ·r_d; as it is unless given [µm].
    disc_temperature
        Temperature of the discs less that of the ring of pins [K].
    load_cases
        Further conditions under which outputs may be limited as well, by names that `tolalloc.at`, `tolalloc.worst` and
        `tolalloc.mean` make, such as ``ta.at(ta.LOST_MOTION, cold)`` with
        ``cold = ta.LoadCase("cold", disc_temperature=-5)``; or a duty cycle's file of them.
    neglected
        Sources that a drawing may leave out, taken as zero, beside those of the first stage, phases, tilts, single pins
        and teeth; ``*`` stands for anything. A bearing's or a mesh's clearance may always be left out: it is then the
        nominal one of the reducer file.
    unit
        Built unit whose curve is shown, by shipped name or path.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.

    Examples
    --------
    >>> reducer("rv20e_liu2020", stiffness="rv20e_table6").reducer.crank_count
    2
    """
    ranges = {"flank": flank_clearance, "radial": radial_clearance, "rotation": rotation_clearance}
    for field, own in ranges.items():
        if own is not None and not is_range(own, _FARTHEST):
            allowed = "two numbers from -50 to 50 µm, the smaller one first"
            raise InputError.at(f"reducer {name}", f"{field}_clearance", own, allowed)
    TEMPERATURE.check(f"reducer {name}", "disc_temperature", disc_temperature, of_argument=True)
    stated = load_cycle(found_from_here(load_cases)) if isinstance(load_cases, str | Path) else load_cases
    cases = require_load_cases(f"reducer {name}", stated)
    if isinstance(neglected, str) or not (
        isinstance(neglected, Sequence) and all(isinstance(pattern, str) for pattern in neglected)
    ):
        allowed = "a list of names in quotation marks, such as ['disc*.tilt']"
        raise InputError.at(f"reducer {name}", "neglected", neglected, allowed)
    chosen = load_reducer(name)
    if torque is not None:
        chosen.torque_on_carrier(torque, f"reducer {name}")
    for case in cases:
        chosen.torque_on_carrier(case.torque, f"load case {case.name} of reducer {name}")
    identified = load_identified_stiffness(stiffness) if stiffness else None
    return ReducerChoice(
        reducer=with_stiffness(chosen, identified) if identified else chosen,
        identified=identified,
        ranges=(rotation_clearance, flank_clearance, radial_clearance),
        torque=torque,
        disc_temperature=float(disc_temperature),
        load_cases=cases,
        neglected=tuple(neglected),
        unit=load_unit(unit) if unit else None,
    )
