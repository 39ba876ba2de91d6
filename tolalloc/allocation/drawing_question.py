"""From requirements to the cheapest drawing: all searches of one question, in order, and what is asked around them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.unit_price import QualityLoss, UnitPrice, YieldLadder, best_yield
from tolalloc.allocation.front.cost_front import CostFront, FrontSearch
from tolalloc.allocation.front.uncertain_region import doubted
from tolalloc.allocation.front.what_if import (
    QuantileResponse,
    Robustness,
    SettingTrade,
    cost_at_yield,
    robustness,
    setting_trade,
)
from tolalloc.allocation.result import AllocationResult, AssembledDrawing, AssemblyChoice
from tolalloc.allocation.search.candidates import ALONE, FREE, GRADES, TABLE, Candidates, NextCandidate
from tolalloc.allocation.search.cost_line import CostLine
from tolalloc.allocation.search.discrete import GradedAllocation, allocate_grades, group_options, with_shared_zones
from tolalloc.allocation.search.proven_bound import BoundSearch, ProvenBound, require_bounded
from tolalloc.allocation.search.settings_scan import other_settings
from tolalloc.allocation.search.steering import explained_by
from tolalloc.allocation.search.zone_allocation import (
    ZoneAllocation,
    allocate,
    promised,
    require_groups,
    scale_in_proportion,
)
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.effort import AllocationEffort
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.requirement import AtYield, Requirement
from tolalloc.allocation.verify.acceptance import (
    AS_GOOD_AS,
    FIRST,
    Acceptance,
    AcceptanceTest,
    AlphaSpending,
    accept_cheapest,
    confidence_of_fewer,
)
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier, cheapest_met
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import KeptLimits
from tolalloc.drawings.compensators import Compensator, assembly_cost, choice_label
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.population import EVENLY, populated
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import ConstantOutputError, FailedUnitsError, InputError
from tolalloc.models.model import Model, is_fast
from tolalloc.running.chunks import one_blas_thread
from tolalloc.running.progress import RunRecord
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.sobol import SourceIndices, sobol_indices
from tolalloc.sensitivity.surrogate.control_variate import learnt

_EXAMINED = 1000
"""Random units of the drawing that tell whether it can be built [-]."""
_COUNTED = 2**15
"""Most random units whose failures a proven bound counts [-]."""


@dataclass(frozen=True, kw_only=True)
class DrawingQuestion:
    """What is asked of the cheapest drawing."""

    model: Model  # The model at the sources of the tolerance table
    space: DesignSpace  # Design variables with every setting free
    requirements: tuple[Requirement, ...]  # What must be kept; the first one limits the leading output
    effort: AllocationEffort  # How much may be computed
    seed: int  # Seed of every random number [-]
    largest_failed_share: float  # Share of units that may fail [-]
    grades: bool  # Whether zones come from ISO 286 grades and preferred numbers alone
    fixed_first: bool  # Whether the settings are first left as they are, which says what freeing them is worth
    front: bool  # Whether cost is traded against the limit
    what_if: bool  # Whether the settings are traded against the zones, and costs, the model and processes are changed
    # What becomes of units beyond a limit, and what the leading output costs a user although it keeps its limit
    unit_price: UnitPrice | None
    quality_loss: QualityLoss | None
    place: str  # Where the question stands, for messages
    boxes: int = 0  # Boxes of zones that a bound of the real optimum is looked for in, 0 for none [-]
    # Scales [-] and settings of a design of another question from which the search starts where it is cheaper
    start: Float[np.ndarray, " variable"] | None = None

    @property
    def limits_one_side_above(self) -> bool:
        """Whether the leading output has one limit, an upper one above 0, along which fronts and prices run."""
        limits = self.requirements[0].limits
        return limits.lower is None and (limits.upper or 0.0) > 0.0

    @property
    def search_confidence(self) -> float:
        """Confidence with which a search reads its units: as far inside the limits as an acceptance test takes [-]."""
        shown, units = 1 - FIRST.error(self.effort.error), self.effort.verification_units
        good_as = 1 if is_fast(self.model) else AS_GOOD_AS
        return confidence_of_fewer(shown, units, good_as * self.effort.confirmation_units)

    def seeds(self, name: str) -> SeedTree:
        """Return the node of the seed tree of a stage."""
        return SeedTree(self.seed).child("allocate", name)

    def require_answerable(self) -> None:
        """Raise unless every stage can be asked: zones to change, steps of ladders, units enough."""
        require_groups(self.space, self.place)
        if self.boxes:
            require_bounded(self.model, self.space, self.requirements, self.place)
        if self.grades:
            group_options(with_shared_zones(self.space))
        if self.unit_price and not self.limits_one_side_above:
            leading = self.requirements[0].output
            raise InputError(f"{self.place}: unit_price needs one upper limit above 0 on {leading}, the first limit.")
        asked = {
            "confirmation_units": (self.effort.confirmation_units, 1 - FIRST.error(self.effort.error)),
            "verification_units": (self.effort.verification_units, self.search_confidence),
        }
        if self.front and self.limits_one_side_above:
            asked["front_units"] = (self.effort.front_units, self.search_confidence)
        if self.what_if and doubted(self.model).uncertain:
            asked["stiffness_units"] = (self.effort.stiffness_units, self.search_confidence)
        for requirement in self.requirements:
            for name, (units, confidence) in asked.items():
                try:
                    requirement.guarantee.require_enough(units, confidence)
                except InputError as error:
                    said = f"{self.place}, effort.allocation.{name} for {requirement.output}, {error}"
                    raise InputError(said) from None

    def verifier(self, search: str, space: DesignSpace) -> Verifier:
        """Return what verifies the designs of one search on random units, other ones than those of any other search."""
        # The search that frees everything at once keeps the stream that it had before there were others.
        direct = SeedTree(self.seed).child("verification")
        return Verifier(
            space=space,
            model=self.model,
            requirements=self.requirements,
            seeds=direct if search == "direct" else self.seeds("verification").child(search),
            units=self.effort.verification_units,
            largest_failed_share=self.largest_failed_share,
            confidence=self.search_confidence,
        )

    def quantile(self, spread: float) -> QuantileResponse:
        """Return the quantile of designs on the real model, common random numbers."""
        errors, units = self.space.errors, self.effort.shared_units
        shared = next(self.seeds("shared").uniform_chunks(units, len(errors.columns)))
        return QuantileResponse(
            space=self.space,
            model=self.model,
            output=self.requirements[0].output,
            standard=errors.standard_values(shared),
            spread=spread,
        )

    def direct(self) -> ZoneAllocation:
        """Return the allocation of tolerances and settings at once, from proportional scaling."""
        verifier = self.verifier("direct", self.space)
        scaled = scale_in_proportion(verifier, self.effort.search.steps)
        start = self._at_best_settings(verifier, self._cheaper_start(verifier, cheapest_met(scaled)))
        return allocate(verifier, scaled, self.effort.search, start)

    def fixed(self) -> ZoneAllocation:
        """Return the allocation of tolerances with the settings as they are."""
        verifier = self.verifier("alone", self.space.fixed)
        return allocate(verifier, scale_in_proportion(verifier, self.effort.search.steps), self.effort.search)

    def free(self, fixed: ZoneAllocation) -> ZoneAllocation:
        """Return the allocation of tolerances and settings together, from where the tolerances alone ended."""
        verifier = self.verifier("joint", self.space)
        # Where the settings as they are keep no limits, the tightest zones are no place to start from.
        own = fixed.chosen if fixed.chosen.met else fixed.baseline
        start = self._at_best_settings(verifier, self._cheaper_start(verifier, own))
        return allocate(verifier, fixed.proportional_tried, self.effort.search, start)

    def _at_best_settings(self, verifier: Verifier, own: VerifiedDesign) -> VerifiedDesign:
        """Return a design, or the same at other settings where the next step from there is the cheaper one.

        Both have the same random units, other ones than those that chose the design.
        """
        space = verifier.space
        design = np.clip(own.design_in(space), space.lower, space.upper)
        found = other_settings(verifier, design)
        if np.array_equal(found, design):
            return own
        try:
            starts = [verifier.verify(at, "at other settings").evenly_divided() for at in (design, found)]
        except FailedUnitsError:
            return own
        return min(starts, key=lambda start: promised(start, self.effort.search.reach))

    def _cheaper_start(self, verifier: Verifier, own: VerifiedDesign) -> VerifiedDesign:
        """Return a design to start from: an own one, or that of another question where it is cheaper and met."""
        if self.start is None:
            return own
        return cheapest_met((own, verifier.verify(self.start, "start")))

    def graded(self, free: ZoneAllocation, fixed: ZoneAllocation | None) -> GradedAllocation:
        """Return the cheaper allocation on ladders of zones, with the settings free or as they are."""
        steps = self.effort.graded_steps
        found = [allocate_grades(self.verifier("graded", self.space).dividing_as(free.chosen), free.chosen, steps)]
        if fixed and self.space.holds_present_settings:
            alone = self.verifier("graded alone", self.space.fixed).dividing_as(fixed.chosen)
            found.append(allocate_grades(alone, fixed.chosen, steps))
        best = cheapest_met(tuple(own.chosen for own in found))
        return next(own for own in found if own.chosen is best)

    def beside_grades(self, free: ZoneAllocation, graded: GradedAllocation) -> ZoneAllocation:
        """Return the allocation of free zones, looked for again from grades that are cheaper: they are such zones."""
        if not graded.chosen.met or (free.chosen.met and free.chosen.cost <= graded.chosen.cost):
            return free
        verifier = self.verifier("beside grades", self.space)
        found = allocate(verifier, free.proportional_tried, self.effort.search, graded.chosen)
        if found.chosen.met and found.chosen.cost <= graded.chosen.cost:
            return found
        return found.with_chosen(graded.chosen, (graded.chosen,))

    @property
    def acceptance_test(self) -> AcceptanceTest:
        """What tests a design on units that no search has seen."""
        return AcceptanceTest(
            model=self.model,
            seeds=self.seeds("confirmation"),
            units=self.effort.confirmation_units,
            error=self.effort.error,
            largest_failed_share=self.largest_failed_share,
        )

    def accepted(self, found: Candidates) -> Candidates:
        """Return what the searches found with the cheapest drawing that an acceptance test passes."""
        test = self.acceptance_test
        admitted = found.admitted()
        # Where no search ended inside all limits, a test of its best design leads to a safer one.
        promising = {name: own for name, own in admitted.items() if own.met or name == FREE}
        if not any(own.met for own in admitted.values()):
            promising = {name: own for name, own in admitted.items() if name in (ALONE, FREE, GRADES)}
        next_candidate = NextCandidate(
            found=found,
            test=test,
            drawn=self.model.drawn_amounts,
            space=self.space,
            verifier=partial(self.verifier, "confirmation"),
        )
        stated = partial(self._cheapest_stated, found, test)
        result = accept_cheapest(test, promising, next_candidate, self.effort.gain, stated)
        tested, missed = len(result.tested), sum(not own.accepted for _, own in result.tested)
        found = found.with_acceptance(result, self.model.drawn_amounts)
        return self.shown_as_drawn(found, test, AlphaSpending(number=tested + 1, missed=missed))

    def _cheapest_stated(
        self, found: Candidates, test: AcceptanceTest, kind: str, design: VerifiedDesign, spending: AlphaSpending
    ) -> VerifiedDesign:
        """Return a design as the drawing states it, or the cheapest on a line through it that a test will show.

        What a search chose comes back after a miss where it still lies inside, and is then tested itself: its line may
        be what missed.
        """
        search = {ALONE: found.fixed, FREE: found.free}.get(kind)
        if search and not (design is search.chosen and spending.missed):
            # Which of the designs of a search is the cheapest one met is also luck; the last is what all led to.
            around = search.tried[-1] if design is search.chosen else design
            known = explained_by(around, (*search.tried, around))
            line = CostLine.through(around, known, self.model.drawn_amounts, partial(self.verifier, "rounded"))
            if shown := line.cheapest_shown(test, spending):
                return shown
        return self.as_drawn(kind, design)

    def as_drawn(self, kind: str, design: VerifiedDesign) -> VerifiedDesign:
        """Return a design with zones and amounts as the drawing states them, verified again if that moves them.

        Ladders have the zones that their drawing states, and so has the tolerance table.
        """
        if kind in (GRADES, TABLE):
            return design
        space, stated = design.space.rounded_down(design.design, self.model.drawn_amounts)
        if space is design.space and np.array_equal(stated, design.design):
            return design
        verifier = self.verifier("rounded", space).dividing_as(design)
        return replace(verifier.verify(stated, design.name), unrounded_cost=design.cost)

    def shown_as_drawn(self, found: Candidates, test: AcceptanceTest, spending: AlphaSpending) -> Candidates:
        """Return candidates that show what the drawing states also where nothing was accepted.

        The least violating design may be one that was not tested. With its zones rounded down it may keep the limits,
        and is then tested with what is left of the error, or another one may violate them least.

        Parameters
        ----------
        found
            What became of the candidates.
        test
            Tests the designs.
        spending
            The error that the next design may spend.
        """
        for _ in found.admitted():
            kind, shown = found.shown
            stated = shown if shown.independent or shown.unrounded_cost else self.as_drawn(kind, shown)
            if stated is shown:
                break
            if stated.met:
                stated = test.run(stated, spending)
                spending = spending.after(accepted=stated.accepted)
            found = found.with_acceptance(Acceptance(drawn=None, tested=((kind, stated),)), self.model.drawn_amounts)
        return found

    def _at_ratios_of(self, design: VerifiedDesign) -> DesignSpace:
        """Return the design variables with every setting free and the ratios of zones in a group that a design has."""
        return replace(self.space, errors=design.space.errors)

    def proven(self, free: ZoneAllocation, record: RunRecord) -> ProvenBound | None:
        """Return what no drawing with free zones costs less than on the real model, if the question asks for it."""
        if not self.boxes:
            return None
        search = BoundSearch(
            space=self.space,
            model=self.model,
            requirements=self.requirements,
            seeds=self.seeds("proven bound"),
            units=min(self.effort.confirmation_units, _COUNTED),
            boxes=self.boxes,
        )
        own, alike = free.chosen, cheapest_met(free.proportional_tried)
        designs = (own.design_in(self.space), alike.design)
        with record.stage("proven bound"):
            return search.prove(designs, own.cost if own.met else np.inf)

    def trade(self, free: ZoneAllocation) -> SettingTrade | None:
        """Return the cost of the cheapest zones over the last settings, those before them as they were chosen.

        There are as many as the effort has numbers of steps; nothing without settings.
        """
        if not self.space.settings:
            return None
        still = max(len(self.space.settings) - len(self.effort.setting_steps), 0)
        traded = zip(self.space.settings[still:], self.effort.setting_steps, strict=False)
        values = (
            *free.chosen.settings[:still, np.newaxis],
            # Denser towards the lower ends, where zones are cheap.
            *(
                np.unique(np.round(own.lower + (own.upper - own.lower) * np.linspace(0.0, 1.0, steps) ** 2, 2))
                for own, steps in traded
            ),
        )
        quantile = replace(self.quantile(free.chosen.spread), space=self._at_ratios_of(free.chosen))
        return setting_trade(quantile, free, values)

    def cost_front(self, found: Candidates) -> CostFront:
        """Return what other limits of the leading output cost, around the drawing, on its ladders if it has any."""
        drawn, graded = found.drawn, found.graded is not None and found.drawn is found.graded.chosen
        space, limit = self._at_ratios_of(drawn), float(self.requirements[0].limits.upper or 0.0)
        search = FrontSearch(
            verifier_of=lambda upper: replace(
                self.verifier(f"front {upper:.9g}", space),
                requirements=self._limited_to(upper),
                units=self.effort.front_units,
            ),
            steps=self.effort.front_steps,
            reach=self.effort.search.reach,
            graded_steps=self.effort.graded_steps * graded,
        )
        # Where the limit is out of reach, the front lies around what is kept instead.
        kept = limit if drawn.met else max(limit, min(drawn.quantile_bound, float(drawn.sample.values.max())))
        return search.around(drawn, kept, self.effort.front_limits)

    def _limited_to(self, upper: float) -> tuple[Requirement, ...]:
        """Return what must be kept with another limit of the leading output."""
        leading, *others = self.requirements
        alone = (replace(leading, limits=Limits(upper=upper)), *others)
        last = others[-1] if others else None
        if not isinstance(last, JointRequirement):
            return alone
        return (*alone[:-1], JointRequirement.of(alone[:-1], last.guarantee))

    def robustness(self, free: ZoneAllocation, graded: GradedAllocation | None) -> Robustness:
        """Return the answers under changed assumptions."""
        verifier = self.verifier("robustness", self._at_ratios_of(free.chosen)).dividing_as(free.chosen)
        verifier = replace(verifier, units=self.effort.stiffness_units)
        return robustness(verifier, free, self.effort.price_nodes, graded)

    def prices(self, free: ZoneAllocation) -> YieldLadder | None:
        """Return the price of a good unit over yield targets, if the question prices the others."""
        price, space = self.unit_price, self._at_ratios_of(free.chosen)
        if price is None:
            return None
        return best_yield(lambda target: cost_at_yield(space, free, target), price, self.effort.yields)

    def kept_with(self, design: VerifiedDesign, errors: ErrorModel, name: str, units: int) -> KeptLimits:
        """Return which random units of a design keep its limits where its parts come in another way."""
        limits = {own.output: own.limits for own in (check.requirement for check in design.checks_alone)}
        drawn = replace(design.space, errors=errors).units(design.design, self.seeds(name), units)
        response = self.model.at(design.settings).reading(tuple(limits))
        return KeptLimits.of(response(drawn), response.outputs, limits)

    def evenly(self, design: VerifiedDesign) -> KeptLimits | None:
        """Return which units keep the limits whose parts only keep their zones; none where no yield is promised.

        Nor where the drawing promises for such parts already.
        """
        errors = populated(design.space.errors, EVENLY)
        promises = any(isinstance(check.requirement.guarantee, AtYield) for check in design.checks)
        if errors.sources == design.space.errors.sources or not promises:
            return None
        units = self.effort.verification_units if is_fast(self.model) else _EXAMINED
        return self.kept_with(design, errors, "evenly", units)

    def shares(self, drawn: VerifiedDesign) -> SourceIndices | None:
        """Return the indices of the leading output by dimension of the drawing, at the zones and settings of a design.

        None if it is constant.
        """
        errors, blocks, leading = drawn.space.errors, self.effort.share_blocks, self.requirements[0].output
        groups = errors.dimension_of_column
        if law := drawn.laws.get(leading):
            return SourceIndices.of_linear(law, groups)
        response, zones = self.model.at(drawn.settings).reading((leading,)), drawn.space.zones(drawn.design)
        experiment = Experiment(response, errors, zones, self.seeds("shares"), self.largest_failed_share)
        cheap = learnt(experiment, blocks)
        fixed = SobolEffort(start=blocks, limit=blocks)
        try:
            return sobol_indices(experiment, fixed, factor_groups=groups, cheap=cheap).of(leading)
        except ConstantOutputError:
            return None

    def examined(self, design: VerifiedDesign) -> Mapping[str, float]:
        """Return what the model says of random units of a design."""
        units = design.space.units(design.design, self.seeds("examination"), _EXAMINED)
        return self.model.at(design.settings).examined(units)


def allocate_drawing(question: DrawingQuestion, record: RunRecord, name: str) -> AllocationResult:
    """Return the cheapest drawing that keeps the requirements.

    Parameters
    ----------
    question
        What is asked.
    record
        Keeps statuses and times.
    name
        Name of the study.

    Notes
    -----
    The order in which a design lives: searches find and verify designs (`tolalloc.allocation.search`); the cheapest one
    that an acceptance test passes is the drawing (`tolalloc.allocation.verify.acceptance.accept_cheapest`, which is
    asked by `DrawingQuestion.accepted`); then what else can be had is asked around it (`tolalloc.allocation.front`).
    """
    question.require_answerable()
    fixed = graded = trade = front = robust = None
    with one_blas_thread():
        if question.fixed_first and question.space.settings:
            with record.stage("tolerances alone"):
                fixed = question.fixed()
            with record.stage("with modification"):
                free = question.free(fixed)
        else:
            with record.stage("allocation"):
                free = question.direct()
        if question.grades:
            with record.stage("grades"):
                graded = question.graded(free, fixed)
        with record.stage("confirmation"):
            found = question.accepted(Candidates(fixed=fixed, free=free, graded=graded))
            fixed, free, graded = found.fixed, found.free, found.graded
        if graded:
            with record.stage("free zones beside grades"):
                free = question.beside_grades(free, graded)
        if question.what_if:
            with record.stage("modification trade"):
                trade = question.trade(free)
        if question.front and question.limits_one_side_above:
            with record.stage("front"):
                front = question.cost_front(Candidates(fixed=fixed, free=free, graded=graded))
        if question.what_if:
            with record.stage("robustness"):
                robust = question.robustness(free, graded)
        proven = question.proven(free, record)
        with record.stage("shares of variance"):
            chosen = Candidates(fixed=fixed, free=free, graded=graded).drawn
            shares = question.shares(chosen)
        with record.stage("units of the drawing"):
            examination, evenly = question.examined(chosen), question.evenly(chosen)
    return AllocationResult(
        name=name,
        model=question.model,
        requirements=question.requirements,
        space=question.space,
        fixed=fixed,
        free=free,
        graded=graded,
        shares=shares,
        trade=trade,
        front=front,
        robustness=robust,
        prices=question.prices(free),
        loss=question.quality_loss,
        error=question.effort.error,
        examination=examination,
        proven=proven,
        evenly=evenly,
    )


@dataclass(frozen=True, kw_only=True)
class AssembledQuestion:
    """What is asked of the cheapest drawing whose parts are chosen at assembly."""

    question: DrawingQuestion  # What is asked of every choice
    choices: Sequence[tuple[Compensator, ...]]  # What acts in each, nothing where parts are taken as they come

    def of(self, acting: tuple[Compensator, ...]) -> DrawingQuestion:
        """Return the question with units assembled so."""
        space = self.question.space
        return replace(self.question, space=replace(space, errors=replace(space.errors, compensators=acting)))

    def tried(self, acting: tuple[Compensator, ...], found: AllocationResult) -> AssemblyChoice:
        """Return what became of a choice."""
        drawn = {own.name: own for own in found.drawn_sources}
        return AssemblyChoice(
            compensators=acting,
            label=choice_label(acting),
            met=found.met,
            zones_cost=found.cost,
            assembly_cost=assembly_cost(acting, found.drawn_sources),
            bound=found.bound,
            joint=found.chosen.joint,
            left_over=max((own.leftover_of(drawn) for own in acting), default=0.0),
        )

    def as_they_come(self, found: AllocationResult) -> KeptLimits:
        """Return which random units of a drawing keep its limits if nothing is chosen."""
        errors = replace(found.drawn.errors, compensators=())
        units = self.question.effort.verification_units
        return self.question.kept_with(found.chosen, errors, "as they come", units)


def allocate_assembled(asked: AssembledQuestion, record: RunRecord, name: str) -> AllocationResult:
    """Return the cheapest drawing over all choices, zones and assembly together.

    Parameters
    ----------
    asked
        What is asked, with what may be chosen.
    record, name
        As of `allocate_drawing`.

    Notes
    -----
    Every choice has the same random numbers, and starts where the one before it ended if that is cheaper. Of choices
    that keep the limits the cheapest sum of zones and assembly wins; of none, the first is shown. What is asked around
    the drawing is asked of it alone.
    """
    if len(asked.choices) == 1 and not asked.choices[0]:
        return allocate_drawing(asked.question, record, name)
    tried, starts = list[AssemblyChoice](), list[Float[np.ndarray, " variable"] | None]()
    start = None
    for acting in asked.choices:
        record.progress.tell(f"parts: {choice_label(acting)}")
        alone = replace(asked.of(acting), front=False, what_if=False, start=start)
        found = allocate_drawing(alone, record, name)
        tried.append(asked.tried(acting, found))
        starts.append(start)
        start = found.chosen.design_in(asked.question.space)
    best = min(range(len(tried)), key=lambda at: (not tried[at].met, tried[at].cost if tried[at].met else at))
    drawn = replace(asked.of(asked.choices[best]), start=starts[best])
    found = allocate_drawing(drawn, record, name)
    with record.stage("parts as they come"):
        kept = asked.as_they_come(found)
    return replace(found, assembled=AssembledDrawing(choices=tuple(tried), chosen=best, as_they_come=kept))
