"""What a user asks for: one study, checked as a whole before anything long runs."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from tolalloc.allocation.cost.process_costs_file import load_process_costs
from tolalloc.allocation.cost.unit_price import QualityLoss, UnitPrice
from tolalloc.allocation.design_space import ClearanceRange, DesignSpace
from tolalloc.allocation.guarantee import AtYield, Guarantee
from tolalloc.allocation.requirement import Requirement
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import CONFIDENCE, allowed_rejections
from tolalloc.drawing.correlation import CorrelatedSource, Correlation
from tolalloc.drawing.correlation_file import load_correlations
from tolalloc.drawing.error_model import ErrorModel
from tolalloc.drawing.sources import Source, neglected_columns
from tolalloc.drawing.tolerance_table import load_tolerance_table, require_small_zones
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.rv.equivalent.columns import source_name
from tolalloc.rv.equivalent.kinematics import HARMONICS
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
from tolalloc.rv.reducer.stiffness import IdentifiedStiffness
from tolalloc.rv.reducer.unit_file import BuiltUnit, load_unit
from tolalloc.rv.response.kernel import PEAK_TO_PEAK, KernelResponse
from tolalloc.rv.response.outputs import OTHER_OUTPUTS
from tolalloc.rv.response.stiffness import stiffness_source
from tolalloc.study.effort import Effort
from tolalloc.units import MICROMETRE

NEGLECTED = (
    "sun.pitch",
    "planet*.pitch",
    "mesh*",
    "*.phase",
    "*.rotation",
    "*.tilt",
    "*.clearance",
    "each_pin.*",
    "*.each_tooth.*",
)
"""Sources that a tolerance table need not list; they are then taken as exact, and the report says so."""

_LARGEST_ZONE = 200 * MICROMETRE
"""Largest zone of a reducer that is believed [m]."""

_FILES = ("reducer", "tolerances", "processes", "process_costs", "correlations", "unit", "stiffness")
"""Fields of a study that name files; what they hold counts, not where they stand."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study.

    Parameters
    ----------
    name
        Name of the study and of its run folder.
    reducer, tolerances
        Shipped names or paths of the user's files.
    processes
        Process capability library that rows of the table may name, by shipped name or path.
    correlations
        Correlations between sources, by path; none if empty.
    process_costs
        Ways to make the features and what each costs, by shipped name or path; none if empty: every feature then costs
        what the tolerance table says, falling as 1/zone.
    neglected
        Sources of the model that the tolerance table leaves out, taken as zero; ``*`` stands for anything.
    unit
        A built unit whose curve is shown, by shipped name or path; none if empty.
    stiffness
        Identified stiffnesses that replace the reducer's, by shipped name or path; none if empty.
    limit_arcsec
        Largest peak-to-peak allowed, output side, one turn [arcsec].
    other_limits
        Output with its unit, such as ``"lost motion [arcmin]"`` → its limits; for ``rank`` and ``allocate``.
    yield_target
        Share of units that must keep a limit [-].
    guarantees
        Output with its unit → what ``allocate`` must show of its limits, where that is not the yield target.
    grades
        Whether ``allocate`` takes zones from ISO 286 grades and preferred numbers alone.
    unit_price
        What becomes of units beyond a limit; ``allocate`` then names the yield with the cheapest good unit.
    quality_loss
        What a peak-to-peak costs a user although it keeps its limit (Taguchi); ``allocate`` states the mean of every
        design.
    torque_nm
        Torque on the carrier, negative against the rotation; the reducer's test torque unless given [N·m].
    flank_clearance_um, radial_clearance_um
        Smallest and largest nominal clearance that the modification may leave [µm].
    seed
        Seed of every random number [-].
    largest_failed_share
        Share of units without an equilibrium above which the study stops [-].
    effort
        How much may be computed.
    """

    name: str
    reducer: str | Path = "rv20e"
    tolerances: str | Path = "rv20e_baseline"
    processes: str | Path = "generic"
    correlations: str | Path = ""
    process_costs: str | Path = ""
    neglected: tuple[str, ...] = NEGLECTED
    unit: str | Path = ""
    stiffness: str | Path = ""
    limit_arcsec: float = 60.0
    other_limits: Mapping[str, Limits] = field(default_factory=dict)
    yield_target: float = 0.9973
    guarantees: Mapping[str, Guarantee] = field(default_factory=dict)
    grades: bool = False
    unit_price: UnitPrice | None = None
    quality_loss: QualityLoss | None = None
    torque_nm: float | None = None
    flank_clearance_um: tuple[float, float] = (1.0, 5.0)
    radial_clearance_um: tuple[float, float] = (5.0, 20.0)
    seed: int = 1
    largest_failed_share: float = 0.01
    effort: Effort = field(default_factory=Effort)

    def __post_init__(self) -> None:
        place = f"study {self.name}"
        for name, value, good, allowed in (
            ("name", self.name, re.fullmatch(r"[\w-][\w. -]*", self.name), "letters, digits, '_', '-', '.' and blanks"),
            ("limit_arcsec", self.limit_arcsec, 0 < self.limit_arcsec <= 3600, "above 0 up to 3600"),
            ("yield_target", self.yield_target, 0.5 <= self.yield_target < 1, "0.5 up to but not 1"),
            ("seed", self.seed, self.seed >= 0, "0 or a positive integer"),
            ("largest_failed_share", self.largest_failed_share, 0 <= self.largest_failed_share < 0.5, "0 to 0.5"),
        ):
            if not good:
                raise InputError.at(place, name, value, allowed)
        for name, (low, high) in (
            ("flank_clearance_um", self.flank_clearance_um),
            ("radial_clearance_um", self.radial_clearance_um),
        ):
            if not -50 <= low <= high <= 50:
                raise InputError.at(place, name, (low, high), "two numbers from -50 to 50, the smaller one first")
        self._require_kinds(place)
        blocks = self.effort.sobol_blocks
        if blocks < 2 or blocks & (blocks - 1):
            raise InputError.at(place, "effort.sobol_blocks", blocks, "a power of two, 2 or more")
        units = self.effort.verification_units
        if allowed_rejections(units, self.yield_target) < 0:
            raise InputError.at(
                place,
                "effort.verification_units",
                units,
                f"enough to show a yield of {self.yield_target:.4%} with 95 % confidence, "
                f"{_units_needed(self.yield_target)} or more",
            )

    def _require_kinds(self, place: str) -> None:
        """Raise unless limits, guarantees and prices are what their fields ask for, and limits are numbers."""
        kinds: tuple[tuple[str, object, type, str], ...] = (
            ("grades", self.grades, bool, "True or False"),
            ("unit_price", self.unit_price or UnitPrice(), UnitPrice, "UnitPrice(...) or None"),
            *((f"other_limits[{name!r}]", own, Limits, "Limits(...)") for name, own in self.other_limits.items()),
            *(
                (f"guarantees[{name!r}]", own, Guarantee, "AtYield(...), AtCpk(...) or WorstCase()")
                for name, own in self.guarantees.items()
            ),
        )
        for name, value, kind, allowed in kinds:
            if not isinstance(value, kind):
                raise InputError.at(place, name, value, allowed)
        for name, own in self.other_limits.items():
            ends = [end for end in (own.lower, own.upper) if end is not None]
            if not np.isfinite(ends).all():
                raise InputError.at(place, f"other_limits[{name!r}]", own, "finite numbers; an open side is None")


def _units_needed(target: float) -> int:
    """Return the smallest sample without a rejection that shows the target with 95 % confidence."""
    return int(np.ceil(np.log(1 - CONFIDENCE) / np.log(target)))


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """A study with all its files read and all names matched.

    Parameters
    ----------
    study
        What was asked for.
    reducer, identified
        The reducer with the stiffness in use, and the identified values if any.
    unit
        Built unit to show, if any.
    space, requirements
        Design variables, and what the allocation must keep, the peak-to-peak first.
    kernel
        The real model at the reducer's own modification.
    stiffness
        What is not known of the identified stiffnesses, a source of the ranking alone.
    neglected
        Patterns of the sources that are taken as zero because the tolerance table does not list them.
    """

    study: Study
    reducer: Reducer
    identified: IdentifiedStiffness | None
    unit: BuiltUnit | None
    space: DesignSpace
    requirements: tuple[Requirement, ...]
    kernel: KernelResponse
    stiffness: CorrelatedSource | None
    neglected: tuple[str, ...]

    @property
    def hash(self) -> str:
        """Digest of the study and of what its files hold, wherever they stand."""
        known = self.identified.content if self.identified else None  # the reducer holds the values alone
        errors = self.space.errors
        sources, correlation = errors.sources, errors.correlation
        asked = {name: value for name, value in asdict(self.study).items() if name not in _FILES}
        priced = self.space.processes
        content = (asked, self.reducer, known, sources, correlation, priced, self.unit, self.kernel.torque)
        return hashlib.sha256(repr(content).encode()).hexdigest()


def _absent_orders(errors: ErrorModel, model: EquivalentModel, place: str) -> list[str]:
    """Return the columns of listed sources whose orders their spectra do not have.

    Raises
    ------
    InputError
        A source that lists only some of its pins or teeth.
    """
    absent = []
    for source in errors.sources:
        own = [column for column in model.columns if source_name(column) == source.name]
        missing = [column for column in own if column not in source.columns]
        if missing and not source.spectrum:
            features = len({column.removesuffix(".x").removesuffix(".y") for column in own})
            raise InputError.at(
                f"{place}, tolerance table, {source.name}", "each", source.each, f"{features}, one per feature"
            )
        absent += missing
    return absent


def _correlation(study: Study, sources: tuple[Source, ...]) -> Correlation:
    """Return the correlations of the study's sources, none unless it names a file."""
    return load_correlations(study.correlations, sources) if study.correlations else Correlation()


def _requirements(study: Study) -> tuple[Requirement, ...]:
    """Return what the study limits, the peak-to-peak first.

    Raises
    ------
    UnknownNameError
        Limits of no output, or a guarantee of no limit.
    """
    place = f"study {study.name}"
    for name in study.other_limits:
        if name not in OTHER_OUTPUTS:
            raise UnknownNameError.among(place, "other_limits", name, OTHER_OUTPUTS)
    limits = {PEAK_TO_PEAK: Limits(upper=study.limit_arcsec), **study.other_limits}
    for name in study.guarantees:
        if name not in limits:
            raise UnknownNameError.among(place, "guarantees", name, limits)
    return tuple(
        Requirement(output=name, limits=own, guarantee=study.guarantees.get(name, AtYield(target=study.yield_target)))
        for name, own in limits.items()
    )


def prepare(study: Study) -> Prepared:
    """Read and check everything a study needs; nothing is solved and nothing is written.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    reducer = load_reducer(study.reducer)
    identified = load_identified_stiffness(study.stiffness) if study.stiffness else None
    if identified:
        reducer = with_stiffness(reducer, identified)
    sources = load_tolerance_table(study.tolerances, study.processes)
    require_small_zones(sources, _LARGEST_ZONE, study.tolerances)
    errors = ErrorModel(sources, correlation=_correlation(study, sources))
    unit = load_unit(study.unit) if study.unit else None
    orders = tuple(sorted({*errors.orders, *(unit.orders if unit else ())}))
    model = EquivalentModel(reducer, orders=orders or HARMONICS)
    listed = {*errors.columns, *errors.still}
    absent = _absent_orders(errors, model, f"study {study.name}")
    left_out = {pattern: neglected_columns((pattern,), model.columns) - listed for pattern in study.neglected}
    fixed: Mapping[str, float] = {
        **dict.fromkeys((column for columns in left_out.values() for column in columns), 0.0),
        **dict.fromkeys(absent, 0.0),
        **errors.still,
        **reducer.modification.deviations,
    }
    kernel = KernelResponse(
        model=model,
        torque=reducer.torque_on_carrier(study.torque_nm, f"study {study.name}"),
        columns=errors.columns,
        fixed=fixed,
    )
    if unit:
        unit.errors(model.columns, reducer.modification.deviations)
    flank, radial = (
        (low * MICROMETRE, high * MICROMETRE) for low, high in (study.flank_clearance_um, study.radial_clearance_um)
    )
    return Prepared(
        study=study,
        reducer=reducer,
        identified=identified,
        unit=unit,
        space=DesignSpace(
            errors=errors,
            stage=reducer.cycloid_stage,
            clearances=ClearanceRange(flank=flank, radial=radial),
            processes=load_process_costs(study.process_costs, sources) if study.process_costs else {},
        ),
        requirements=_requirements(study),
        kernel=kernel,
        stiffness=stiffness_source(identified, reducer) if identified else None,
        neglected=tuple(pattern for pattern, columns in left_out.items() if columns),
    )
