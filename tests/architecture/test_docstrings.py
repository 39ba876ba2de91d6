"""Every public function that computes says by which equation, whose, and what comes out of one case.

A docstring has a source if a year or "own derivation" stands in it outside its examples, for the reducers also if an
equation does, and a worked number if it has an example, which `test_examples.py` runs.
"""

from __future__ import annotations

import ast
import re
import sys
from functools import cache

from tests.studies.command import ROOT

ROOMS = ("reducers", "sensitivity", "capability", "allocation")
SOURCE = re.compile(r"\b(1[789]|20)\d\d\b|own\s+derivation", re.IGNORECASE)
EQUATION = re.compile(r"[=≈≤≥∝∑Σ√∫]")
EXAMPLE = re.compile(r"^\s*(>>>|\.\.\.).*$", re.MULTILINE)

COMPUTES_NOTHING = {
    # reads a file or a table
    "reducers.choice.reducer": "reads",
    "reducers.load_case.require_load_cases": "checks",
    "reducers.load_case.load_cycle": "reads",
    "reducers.load_case.require_duty": "checks",
    "reducers.duty.require_cycle": "checks",
    "allocation.front.uncertain_region.doubted": "reads",
    "allocation.search.proven_bound.require_bounded": "checks",
    "reducers.cycloid.solvers.pins.pin_slopes": "passes on",
    "reducers.reducer.files.load_identified_stiffness": "reads",
    "reducers.reducer.form.load_designed": "reads",
    "reducers.reducer.form.read_profile": "reads",
    "reducers.reducer.files.load_reducer": "reads",
    "reducers.reducer.files.write_identified_stiffness": "reads",
    "reducers.reducer.files.write_modified": "reads",
    "wings.motion.simulation.prepare_simulation": "reads",
    "reducers.unit_file.load_unit": "reads",
    "reducers.unit_file.load_units": "reads",
    "reducers.unit_file.table_text": "reads",
    "reducers.unit_file.unit_names": "reads",
    "reducers.unit_file.units_text": "reads",
    "allocation.cost.points.currency_of_prices": "reads",
    "allocation.cost.points.load_shop_points": "reads",
    "allocation.cost.points.points_of": "reads",
    "allocation.cost.process_costs.currency_of_costs": "reads",
    "allocation.cost.process_costs.load_process_costs": "reads",
    "allocation.space.design_space.named_zones": "reads",
    # raises or says what is wrong
    "reducers.equivalent.solvers.workspace.moved_too_far": "checks",
    "reducers.cycloid.tooth_profile.require_points": "checks",
    "wings.motion.prototype.engine": "checks",
    "reducers.equivalent.model.count_statuses": "checks",
    "reducers.reducer.stiffness.checked_correlation": "checks",
    "reducers.scene.is_placed": "checks",
    "allocation.search.lagrange_dual.require_convex": "checks",
    "allocation.search.zone_allocation.require_groups": "checks",
    "allocation.space.design_space.outside_range": "checks",
    "capability.limit_state.require_samples": "checks",
    "capability.monte_carlo.require_few_failures": "checks",
    # picks the best of what is given, or part of it
    "reducers.equivalent.solvers.batch.most_steps": "picks",
    "reducers.equivalent.solvers.pressing.normal": "picks",
    "reducers.equivalent.columns.source_name": "picks",
    "reducers.equivalent.condensation.bilateral_groups": "picks",
    "reducers.equivalent.condensation.error_columns": "picks",
    "reducers.equivalent.condensation.retained_coordinates": "picks",
    "reducers.reducer.files.with_stiffness": "picks",
    "reducers.response.outputs.limited_outputs": "picks",
    "reducers.response.outputs.readings_of": "picks",
    "reducers.response.outputs.requirements_of": "picks",
    "reducers.equivalent.outputs.bearings_of": "picks",
    "reducers.equivalent.outputs.outputs_of": "picks",
    "reducers.families.known.family_of": "picks",
    "reducers.response.outputs.wave_outputs": "picks",
    "reducers.scene.place_of": "picks",
    "allocation.search.discrete.choice_beside": "picks",
    "allocation.space.design_space.cheapest": "picks",
    "allocation.verify.verification.cheapest_met": "picks",
    "sensitivity.surrogate.regression.on_products": "picks",
    # puts things in order or together
    "wings.motion.solvers.pin_forces.fill_forces": "orders",
    "reducers.choice.bind": "orders",
    "reducers.equivalent.columns.columns_of": "orders",
    "reducers.equivalent.interfaces.tilt_terms": "orders",
    "reducers.equivalent.interfaces.tooth_terms": "orders",
    "reducers.equivalent.interfaces.wave_terms": "orders",
    "reducers.equivalent.perfect.exact_unit": "orders",
    "reducers.equivalent.solvers.batch.make_batch": "orders",
    "reducers.equivalent.solvers.batch.make_history": "orders",
    "reducers.equivalent.solvers.batch.nonzero_rows": "orders",
    "reducers.equivalent.solvers.batch.nonzero_waves": "orders",
    "reducers.equivalent.solvers.batch.start_next": "orders",
    "reducers.equivalent.solvers.contact_solver.make_problem": "orders",
    "reducers.equivalent.solvers.contact_solver.make_work": "orders",
    "reducers.equivalent.solvers.contact_solver.with_tables": "orders",
    "reducers.equivalent.solvers.play.begin_search": "orders",
    "reducers.equivalent.solvers.play.bring_play": "orders",
    "reducers.equivalent.solvers.play.list_touched": "orders",
    "reducers.equivalent.solvers.play.make_play": "orders",
    "reducers.equivalent.solvers.pressing.make_pressing": "orders",
    "reducers.equivalent.solvers.records.design_of": "orders",
    "reducers.equivalent.solvers.simd.aligned": "orders",
    "reducers.equivalent.solvers.simd.compress": "orders",
    "reducers.equivalent.solvers.simd.entry": "orders",
    "reducers.equivalent.solvers.simd.expand": "orders",
    "reducers.equivalent.solvers.simd.load": "orders",
    "reducers.equivalent.solvers.simd.spread": "orders",
    "reducers.equivalent.solvers.simd.store": "orders",
    "reducers.equivalent.solvers.turn.make_turn": "orders",
    "reducers.equivalent.solvers.workspace.fill_lane": "orders",
    "reducers.equivalent.solvers.workspace.look_at_all_taken": "orders",
    "reducers.equivalent.solvers.workspace.make_memory": "orders",
    "reducers.equivalent.solvers.workspace.make_workspace": "orders",
    "reducers.equivalent.springs.harmonic_columns": "orders",
    "reducers.equivalent.springs.vector_columns": "orders",
    "reducers.reducer.bearings.friction_assumptions": "orders",
    "reducers.scene.places_of": "orders",
    "reducers.settings.clearance_settings": "orders",
    "reducers.reducer.idle_torque.number_and_turns": "orders",
    "reducers.load_case.at": "orders",
    "reducers.load_case.change": "orders",
    "reducers.load_case.worst": "orders",
    "reducers.load_case.mean": "orders",
    "reducers.load_case.combined_outputs": "orders",
    "reducers.settings.temperature_condition": "orders",
    "reducers.settings.torque_condition": "orders",
    "allocation.cost.points.shop_fits": "orders",
    "allocation.search.discrete.group_ladders": "orders",
    "allocation.search.discrete.group_options": "orders",
    "allocation.search.lagrange_dual.by_form": "orders",
    "capability.limit_state.run_of": "orders",
    # asks others one after the other and passes on what they say
    "reducers.cycloid.solvers.pins.pin_forces": "passes on",
    "wings.motion.solvers.stepping.advance": "passes on",
    "allocation.space.requirement.spread_constraints": "passes on",
    "allocation.space.joint_yield.divided": "passes on",
    "allocation.space.joint_yield.tightened": "passes on",
    "allocation.drawing_question.allocate_assembled": "orders",
    "allocation.space.joint_yield.limited_by": "passes on",
    "reducers.equivalent.solvers.play.settle_with_play": "passes on",
    "reducers.equivalent.solvers.pressing.press": "passes on",
    "reducers.equivalent.solvers.simd.above": "passes on",
    "reducers.equivalent.solvers.simd.choose": "passes on",
    "reducers.equivalent.solvers.simd.count_bits": "passes on",
    "reducers.equivalent.solvers.simd.fma": "passes on",
    "reducers.equivalent.solvers.simd.larger": "passes on",
    "reducers.equivalent.solvers.simd.magnitude": "passes on",
    "reducers.equivalent.solvers.simd.root": "passes on",
    "reducers.contact.contact_of": "passes on",
    "reducers.cycloid.loaded_contact.assess": "passes on",
    "reducers.cycloid.solvers.pins.pin_clearances": "passes on",
    "wings.motion.prototype.simulate_prototype": "passes on",
    "wings.motion.stepping.untold": "passes on",
    "wings.motion.solvers.pin_forces.fill_pin_forces": "passes on",
    "reducers.equivalent.compiled_ahead.compile_ahead": "passes on",
    "reducers.equivalent.model.cached_model": "passes on",
    "reducers.equivalent.solvers.adjoint.solve_peak_to_peak_derivatives": "passes on",
    "reducers.equivalent.solvers.adjoint.solve_rotation_derivatives": "passes on",
    "reducers.equivalent.solvers.adjoint.solve_pin_force_derivatives": "passes on",
    "reducers.equivalent.solvers.batch.solve_batch_at": "passes on",
    "reducers.equivalent.solvers.contact_solver.problem_at_node": "passes on",
    "reducers.equivalent.solvers.contact_solver.solve_at_node": "passes on",
    "reducers.equivalent.solvers.extremes.refine": "passes on",
    "reducers.equivalent.solvers.extremes.solve_extremes": "passes on",
    "reducers.equivalent.solvers.turn.part_of": "picks",
    "reducers.equivalent.solvers.turn.solve_batch": "passes on",
    "reducers.equivalent.solvers.turn.solve_curves": "passes on",
    "reducers.equivalent.solvers.turn.solve_forces": "passes on",
    "reducers.equivalent.solvers.workspace.solve_anywhere": "passes on",
    "reducers.equivalent.solvers.workspace.solve_between": "passes on",
    "reducers.scene.scene_of": "passes on",
    "wings.motion.simulation.simulate": "passes on",
    "allocation.drawing_question.allocate_drawing": "passes on",
    "allocation.front.pareto_front.exact_front": "passes on",
    "allocation.front.pareto_front.pareto_front": "passes on",
    "allocation.front.pareto_front.searched_front": "passes on",
    "allocation.search.convex_program.front": "passes on",
    "allocation.search.process_choice.front": "passes on",
    "allocation.search.zone_allocation.allocate": "passes on",
    "allocation.search.zone_allocation.step_from": "passes on",
    "allocation.space.design_space.repriced": "passes on",
    "sensitivity.measures.rank": "passes on",
    "sensitivity.sobol.solved": "passes on",
}
"""Function → what it does instead of computing."""

NOT_YET: tuple[str, ...] = ()
"""Functions that compute and do not say so yet; nothing is added here."""


@cache
def _functions() -> dict[str, str]:
    """Return the docstring of every public function of a module."""
    found = {}
    for room in ROOMS:
        for path in sorted((ROOT / "tolalloc" / room).rglob("*.py")):
            module = ".".join(path.relative_to(ROOT / "tolalloc").with_suffix("").parts).removesuffix(".__init__")
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                    found[f"{module}.{node.name}"] = ast.get_docstring(node) or ""
    return found


def _has_source(name: str, text: str) -> bool:
    """Return whether a docstring says whose equation it is, or for a reducer which one."""
    said = EXAMPLE.sub("", text)
    return bool(SOURCE.search(said) or (name.startswith("reducers.") and EQUATION.search(said)))


def unsourced() -> set[str]:
    """Return the functions without a source or without a worked number."""
    return {name for name, text in _functions().items() if not (_has_source(name, text) and EXAMPLE.search(text))}


def test_public_functions_have_a_source_and_a_worked_number():
    known = _functions()
    for room in ROOMS:
        own = {name for name in known if name.startswith(f"{room}.")}
        left = own.intersection(NOT_YET)
        nothing = own.intersection(COMPUTES_NOTHING)
        sys.stdout.write(f"{room}: {len(own)} functions, {len(nothing)} compute nothing, {len(left)} to do\n")
    assert unsourced() - COMPUTES_NOTHING.keys() == set(NOT_YET)


def test_lists_of_functions_are_true():
    assert not COMPUTES_NOTHING.keys() - _functions().keys()
    assert not COMPUTES_NOTHING.keys() & set(NOT_YET)
    assert set(COMPUTES_NOTHING.values()) <= {"reads", "checks", "picks", "orders", "passes on"}
    assert list(NOT_YET) == sorted(set(NOT_YET))
