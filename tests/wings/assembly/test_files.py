"""Chain files and files of measured part errors: what they say is taken over, what they cannot mean is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.builders import written
from tolalloc.exceptions import InputError, TolallocError
from tolalloc.reading.units import ARCSECOND, DEGREE, MILLIMETRE
from tolalloc.reducers.equivalent.interfaces import crank_disc
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.wings.assembly.files import DATA, load_errors, load_plan
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.steps import AssemblyStep, check_steps

SHORT = """
name = "short"
source = "nobody"
datum = "bed"
precision = 2

[[part]]
name = "column"
on = "bed"
tolerance_arcsec = [30, 20, 0]

[[part]]
name = "head"
on = "column"
turned_deg = [0, 0, 90]
position_mm = [0, 0, 250]
tolerance_arcsec = [10, 10, 10]
"""

STEPS = """
[[step]]
mount = "column"
adjust = ["column"]
effort = { column = 3 }
measure = ["column"]

[[step]]
mount = "head"
adjust = ["column", "head"]
effort = { head = 2 }
measure = ["head - column"]
"""

COSTS = """
[tolerances]
smallest_arcsec = 3
largest_arcsec = 120
"""


def load(folder: Path, *changes: tuple[str, str], text: str = SHORT) -> AssemblyPlan:
    """Return the plan of a file with changes, each of a text that it has."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "short.chain.toml"
    path.write_text(text, encoding="utf-8")
    return load_plan(path)


def priced(text: str) -> str:
    """Return the file with a reciprocal cost of every part."""
    return (
        re.sub(r"(tolerance_arcsec.*\n)", r'\1cost = { form = "reciprocal", factor = [1, 2, 3] }' + "\n", text) + COSTS
    )


@pytest.fixture(scope="module")
def bx40e() -> AssemblyPlan:
    return load_plan("bx40e")


def test_the_shipped_chain_is_the_instance_that_its_assumptions_state(bx40e):
    assert bx40e.chain.datum == "KC0"
    assert [(part.name, part.on) for part in bx40e.chain.parts] == [
        ("KC1", "KC0"),
        ("KC2", "KC1"),
        ("KC3", "KC0"),
        ("KC4", "KC3"),
    ]
    np.testing.assert_allclose([part.turned[2] for part in bx40e.chain.parts], [0, 0, np.pi, np.pi])
    np.testing.assert_allclose(bx40e.tolerances, 30 * ARCSECOND)
    assert (bx40e.state_weight, bx40e.weights.tolist()) == (10.0, [1.0] * 4)
    assert bx40e.measurement_noise == pytest.approx(2 * ARCSECOND)
    assert bx40e.adjustment_noise == pytest.approx(ARCSECOND)
    assert bx40e.steps[2] == AssemblyStep(
        mount="KC3",
        adjust=("KC1", "KC2", "KC3"),
        effort={"KC1": 10.0, "KC2": 10.0, "KC3": 1.0, "KC4": 1000.0},
        measure=("KC3",),
    )
    required = bx40e.requirements
    np.testing.assert_allclose(required.tilt_limit / ARCSECOND, [15, 16, 14, 14])
    np.testing.assert_allclose(required.rotation_limit / ARCSECOND, [10.8, 11.5, 10, 10])
    np.testing.assert_allclose(required.factor / ARCSECOND, [[120, 120, 60], [80, 80, 100]] * 2)
    np.testing.assert_allclose([required.smallest / ARCSECOND, required.largest / ARCSECOND], [3, 120])
    assert (required.form, required.effort_price, required.fixed.any()) == ("reciprocal", 0.0, False)


def test_every_number_of_the_shipped_chain_is_marked_as_an_assumption(bx40e):
    said = " ".join(bx40e.assumptions)
    # Q = 10 and an effort of 1000 are printed.
    for number in ("±30″", "2″", "1″", "180", "effort of 1 ", "10 when mounted", "120, 120 and 60", "80, 80 and 100"):
        assert number in said, number
    for number in ("15, 16, 14 and 14″", "10.8, 11.5, 10 and 10″", "3 and 120″"):
        assert number in said, number


def test_the_shipped_chain_acts_on_columns_that_its_reducer_has(bx40e):
    model = EquivalentModel(load_reducer(bx40e.reducer))
    found = bx40e.chain.columns(np.ones((4, 3)))
    assert found.keys() <= set(model.columns)
    assert len(found) == 14


def test_a_crank_hands_its_tilt_on_to_the_bearing_once(bx40e):
    """A true disc goes with its journal: beside the journal's offset, none of the bore may take it back."""
    reducer, errors = load_reducer(bx40e.reducer), np.zeros((4, 3))
    errors[0] = [20 * ARCSECOND, -10 * ARCSECOND, 0.0]
    tilted = bx40e.chain.columns((bx40e.chain.transform @ errors.ravel()).reshape(4, 3))
    assert tilted["disc1.tilt.x"] == tilted["crank1.tilt.x"] == pytest.approx(20 * ARCSECOND)
    at = Positions(reducer, np.zeros(1))
    bearings = crank_disc(at)
    moved = bearings.error[0] @ np.array([float(tilted.get(name, 0.0)) for name in bearings.columns])
    np.testing.assert_allclose(moved[:2], at.plane(0) * errors[0, [1, 0]] * [1, -1], rtol=1e-12)


def test_every_number_of_the_shipped_reducer_is_marked_as_an_assumption():
    reducer, said = load_reducer("bx40e"), " ".join(load_reducer("bx40e").assumptions)
    assert reducer.stiffness.pin_contact_law == "constant"
    for number in ("21 and 42", "40 pins", "3 mm", "64 mm", "1.3 mm", "12 mm", "207", "208", "+8 µm", "−2 µm", "1 N·m"):
        assert number in said, number
    same = load_reducer("rv40e_xi2015")
    assert (reducer.first_stage, reducer.cycloid_stage) == (same.first_stage, same.cycloid_stage)
    assert (reducer.modification, reducer.stiffness) == (same.modification, same.stiffness)


def test_what_is_left_out_takes_its_default(tmp_path):
    plan = load(tmp_path)
    assert (plan.reducer, plan.requirements, plan.assumptions) == ("", None, ())
    assert (plan.measurement_noise, plan.adjustment_noise, plan.state_weight) == (0.0, 0.0, 2.0)
    np.testing.assert_allclose(plan.tolerances, ARCSECOND * np.array([[30, 20, 0], [10, 10, 10]]))
    np.testing.assert_allclose(plan.chain.parts[1].turned, [0, 0, 90 * DEGREE])
    np.testing.assert_allclose(plan.chain.parts[1].position, [0, 0, 250 * MILLIMETRE])
    assert [step.adjust for step in plan.steps] == [("column",), ("column", "head")]
    assert [step.measure for step in plan.steps] == [("column",), ("head",)]
    assert plan.steps[1].effort == {"column": 10.0, "head": 1.0}
    check_steps(plan.chain, plan.steps, "short")


def test_parts_that_are_not_there_may_be_turned_in_zhang2025s_own_way_alone(tmp_path):
    plan = load(tmp_path, ("precision = 2", 'precision = 2\nadjust = "all"\nmeasure = "mounted"'))
    assert plan.steps[0] == AssemblyStep(
        mount="column", adjust=("column", "head"), effort={"column": 1.0, "head": 1000.0}, measure=("column",)
    )
    assert plan.space.adjusting[0].any(axis=0).all()
    with pytest.raises(InputError, match="step 1: adjust names head, which is not mounted yet"):
        check_steps(plan.chain, plan.steps, "short")


def test_steps_are_taken_as_they_are_listed(tmp_path):
    plan = load(tmp_path, text=SHORT + STEPS)
    assert plan.steps == (
        AssemblyStep(mount="column", adjust=("column",), effort={"column": 3.0}, measure=("column",)),
        AssemblyStep(mount="head", adjust=("column", "head"), effort={"head": 2.0}, measure=("head - column",)),
    )
    np.testing.assert_array_equal(plan.space.observing[1], np.hstack([-np.eye(3), np.eye(3)]))


def test_costs_and_limits_are_taken_in_their_units(tmp_path):
    required = load(
        tmp_path,
        ("smallest_arcsec = 3", "effort_price = 0.02\nsmallest_arcsec = 3"),
        ('name = "head"', 'name = "head"\nrotation_limit_arcsec = 5\nweight = 0.5'),
        text=priced(SHORT),
    ).requirements
    np.testing.assert_allclose(required.factor, ARCSECOND * np.array([[1, 2, 3]] * 2))
    assert required.effort_price == pytest.approx(0.02 / ARCSECOND**2)
    assert required.tilt_limit.tolist() == [np.inf, np.inf]
    np.testing.assert_allclose(required.rotation_limit, [np.inf, 5 * ARCSECOND])


def test_exponential_costs_have_a_scale(tmp_path):
    text = priced(SHORT).replace('"reciprocal",', '"exponential", fixed = [1, 1, 0], scale_arcsec = [20, 20, 30],')
    required = load(tmp_path, text=text).requirements
    assert required.form == "exponential"
    np.testing.assert_allclose(required.factor, [[1, 2, 3]] * 2)
    np.testing.assert_allclose(required.fixed, [[1, 1, 0]] * 2)
    np.testing.assert_allclose(required.scale, ARCSECOND * np.array([[20, 20, 30]] * 2))


def test_a_reducers_file_stands_beside_the_chain_file(tmp_path):
    (tmp_path / "mine.toml").write_text((PRESETS / "bx40e.reducer.toml").read_text(encoding="utf-8"), encoding="utf-8")
    plan = load(tmp_path, ("precision = 2", 'precision = 2\nreducer = "mine.toml"'))
    assert plan.reducer == str(tmp_path / "mine.toml")
    assert load_reducer(plan.reducer).name == "BX40E"


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            'on = "bed"',
            'on = "head"',
            "FILE, datum flow chain: part column is 'column on head on column'; allowed is parts that end on the datum "
            "bed.",
        ),
        (
            'on = "column"',
            'on = "colunm"',
            "FILE, datum flow chain, part head: unknown part under on 'colunm'; the nearest known is column.",
        ),
        (
            'name = "head"',
            'name = "column"',
            "FILE, datum flow chain: part is 'column'; allowed is a name that no other part and no datum has.",
        ),
        ('datum = "bed"', "", "FILE: datum is missing."),
        ("precision = 2", "", "FILE: precision is missing."),
        ("precision = 2", "precision = -1", "FILE: precision is -1; input should be greater than or equal to 0."),
        ("precision = 2", "precision = nan", "FILE: precision is nan; input should be a finite number."),
        (
            'on = "bed"',
            'on = "bed"\nweight = -2',
            "FILE, part column: weight is -2; input should be greater than or equal to 0.",
        ),
        (
            "tolerance_arcsec = [30",
            "tolerance_deg = [30",
            "FILE, part column: unknown field 'tolerance_deg'; the nearest known are tolerance_arcsec, turned_deg.",
        ),
        (
            "[30, 20, 0]",
            "[30, 0.008, 0]",
            "FILE, part column: tolerance_arcsec is [30, 0.008, 0]; about y: is that in degrees? allowed are "
            "arcseconds from 0.1 to 3600.",
        ),
        (
            "[30, 20, 0]",
            "[30, 4000, 0]",
            "FILE, part column: tolerance_arcsec is [30, 4000, 0]; about y: allowed are arcseconds from 0.1 to 3600.",
        ),
        (
            "[30, 20, 0]",
            "[-30, 20, 0]",
            "FILE, part column: tolerance_arcsec is [-30, 20, 0]; about x: allowed are arcseconds from 0.1 to 3600.",
        ),
        (
            "[30, 20, 0]",
            "[30, 20]",
            "FILE, part column: tolerance_arcsec is [30, 20]; allowed are three numbers, for x, y and z.",
        ),
        (
            "[30, 20, 0]",
            "30",
            "FILE, part column: tolerance_arcsec is 30; allowed are three numbers, for x, y and z.",
        ),
        (
            "[30, 20, 0]",
            '["30", 20, 0]',
            "FILE, part column: tolerance_arcsec is ['30', 20, 0]; allowed are three numbers, for x, y and z.",
        ),
        (
            "[0, 0, 90]",
            "[0, 0, 90, 0]",
            "FILE, part head: turned_deg is [0, 0, 90, 0]; allowed are three numbers, for x, y and z.",
        ),
        (
            'name = "head"',
            'name = "head - top"',
            "FILE, part head - top: name is 'head - top'; allowed is a name without spaces at its ends and without "
            "' - ', which parts two names.",
        ),
        (
            'on = "bed"',
            'on = "bed"\ntilt_limit_arcsec = 0.004',
            "FILE, part column: tilt_limit_arcsec is 0.004; is that in degrees? allowed are arcseconds from 0.1 to "
            "3600.",
        ),
        (
            'on = "bed"',
            'on = "bed"\ntilt_limit_arcsec = 15',
            "FILE: tilt_limit_arcsec is stated but no part has a cost; allowed is with a cost of every part.",
        ),
        (
            "precision = 2",
            "precision = 2\n[tolerances]\nsmallest_arcsec = 3\nlargest_arcsec = 120",
            "FILE: tolerances is stated but no part has a cost; allowed is with a cost of every part.",
        ),
        (
            "precision = 2",
            'precision = 2\nadjust = "none"',
            "FILE: adjust is 'none'; input should be 'current', 'mounted' or 'all'.",
        ),
        (
            "precision = 2",
            'precision = 2\nmeasure = "all"',
            "FILE: measure is 'all'; input should be 'current' or 'mounted'.",
        ),
        (
            "precision = 2",
            "precision = 2\n[effort]\njust_mounted = 0",
            "FILE: effort.just_mounted is 0; input should be greater than 0.",
        ),
        (
            "precision = 2",
            "precision = 2\n[effort]\nmounted_earlier = -10",
            "FILE: effort.mounted_earlier is -10; input should be greater than 0.",
        ),
        (
            "precision = 2",
            "precision = 2\n[effort]\nnot_mounted = nan",
            "FILE: effort.not_mounted is nan; input should be a finite number.",
        ),
        (
            "precision = 2",
            "precision = 2\n[noise]\nmeasurement_arcsec = -2",
            "FILE: noise.measurement_arcsec is -2; allowed are 0 and arcseconds from 0.01 to 3600.",
        ),
        (
            "precision = 2",
            "precision = 2\n[noise]\nmeasurement_arcsec = 0.0005",
            "FILE: noise.measurement_arcsec is 0.0005; is that in degrees? "
            "allowed are 0 and arcseconds from 0.01 to 3600.",
        ),
        (
            "precision = 2",
            "precision = 2e6",
            "FILE: precision is 2000000.0; input should be less than or equal to 1000000.",
        ),
        (
            "precision = 2",
            'precision = 2\nreducer = "bx40"',
            "shipped reducer files: unknown name 'bx40'; the nearest known is bx40e.",
        ),
        (
            "precision = 2",
            'precision = 2\nreducer = "mine.toml"',
            "FOLDER/mine.toml: no such file; shipped reducer files are bx40e, cd29, rv110e, rv160e, rv20e, "
            "rv20e_liu2020, rv27c, rv40e, rv40e_xi2015, rv80e.",
        ),
    ],
)
def test_a_file_that_describes_no_assembly_is_refused(tmp_path, old, new, sentence):
    with pytest.raises(TolallocError) as refusal:
        load(tmp_path, (old, new))
    path = str(tmp_path / "short.chain.toml")
    assert str(refusal.value) == sentence.replace("FILE", path).replace("FOLDER", str(tmp_path))


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            'adjust = ["column"]',
            'adjust = ["column", "head"]',
            "FILE, step 1: adjust names head, which is not mounted yet; allowed is column.",
        ),
        (
            'measure = ["column"]',
            'measure = ["head - column"]',
            "FILE, step 1: measure names head, which is not mounted yet; allowed is column.",
        ),
        (
            "effort = { column = 3 }",
            "effort = { column = 0 }",
            "FILE, step 1: effort.column is 0; input should be greater than 0.",
        ),
        (
            "effort = { column = 3 }",
            "effort = { column = nan }",
            "FILE, step 1: effort.column is nan; input should be a finite number.",
        ),
        (
            "effort = { column = 3 }",
            "effort = { head = 3 }",
            "FILE, step 1: effort names head; allowed are parts that the step adjusts.",
        ),
        (
            '"head - column"',
            '"head-column"',
            "FILE, step 2: measure is 'head-column'; allowed is one part - another, with spaces around the sign.",
        ),
        (
            '"head - column"',
            '"head - head"',
            "FILE, step 2: measure is 'head - head'; allowed is a part, or one part - another.",
        ),
        (
            'mount = "head"',
            'mount = "column"',
            "FILE, step 2: mount is 'column'; allowed is a part that is not mounted yet.",
        ),
        ('mount = "column"\n', "", "FILE, step 1: mount is missing."),
        (
            "precision = 2",
            'precision = 2\nadjust = "mounted"',
            "FILE: adjust stands beside [[step]]; allowed is one of both, as every step says its own.",
        ),
        (
            "precision = 2",
            "precision = 2\n[effort]\njust_mounted = 2",
            "FILE: effort stands beside [[step]]; allowed is one of both, as every step says its own.",
        ),
    ],
)
def test_steps_that_cannot_be_carried_out_are_refused(tmp_path, old, new, sentence):
    with pytest.raises(TolallocError) as refusal:
        load(tmp_path, (old, new), text=SHORT + STEPS)
    assert str(refusal.value) == sentence.replace("FILE", str(tmp_path / "short.chain.toml"))


def test_steps_mount_every_part_in_order(tmp_path):
    with pytest.raises(
        InputError, match=r"steps is 'none mounts head'; allowed is steps that mount every part once\.$"
    ):
        load(tmp_path, text=SHORT + STEPS[: STEPS.index('\n[[step]]\nmount = "head"')])
    first, second = STEPS.split("\n\n")
    swapped = second.replace('["column", "head"]', '["head"]').replace("head - column", "head") + "\n\n" + first
    with pytest.raises(
        InputError, match=r"steps is 'head, column'; allowed is the order of the parts: column, head\.$"
    ):
        load(tmp_path, text=SHORT + swapped)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            'cost = { form = "reciprocal", factor = [1, 2, 3] }\n',
            "",
            "FILE, part column: cost is missing; allowed is a cost of every part or of none.",
        ),
        (
            'form = "reciprocal"',
            'form = "exponential", scale_arcsec = [20, 20, 20]',
            "FILE, part head: cost.form is 'reciprocal'; allowed is 'exponential', the same of every part.",
        ),
        (
            'form = "reciprocal"',
            'form = "exponential"',
            "FILE, part column: cost: form is 'exponential'; allowed is a scale_arcsec with the exponential form and "
            "none with the other.",
        ),
        (
            'form = "reciprocal"',
            'form = "linear"',
            "FILE, part column: cost.form is 'linear'; input should be 'reciprocal' or 'exponential'.",
        ),
        ("[1, 2, 3]", "[1, 0, 3]", "FILE, part column: cost.factor.1 is 0; input should be greater than 0."),
        (COSTS, "", "FILE: tolerances is missing; parts with a cost need smallest_arcsec and largest_arcsec."),
        (
            "smallest_arcsec = 3",
            "smallest_arcsec = 130",
            "FILE: tolerances: smallest_arcsec is 130; allowed is below largest_arcsec = 120.",
        ),
    ],
)
def test_costs_that_allow_no_allocation_are_refused(tmp_path, old, new, sentence):
    with pytest.raises(TolallocError) as refusal:
        load(tmp_path, (old, new), text=priced(SHORT))
    assert str(refusal.value) == sentence.replace("FILE", str(tmp_path / "short.chain.toml"))


def test_a_truncated_chain_file_is_refused(tmp_path):
    text = (DATA / "bx40e.chain.toml").read_text(encoding="utf-8")
    with pytest.raises(InputError, match=r"not complete TOML; is the file truncated\?"):
        load(tmp_path, text=text[: len(text) // 3])
    with pytest.raises(TolallocError, match=r"unknown name 'bx40'; the nearest known is bx40e\."):
        load_plan("bx40")


ERRORS = """part,x [arcsec],y [arcsec],z [arcsec]
KC1,10,-20.5,0
KC2,1,2,3
KC3,0,0,0
KC4,-3600,1e1,60
"""


def errors_of(folder: Path, plan: AssemblyPlan, text: str, encoding: str = "utf-8") -> np.ndarray:
    return load_errors(written(folder / "errors.csv", text, encoding), plan)


def test_measured_errors_are_read_in_the_order_of_the_chain(tmp_path, bx40e):
    expected = ARCSECOND * np.array([[10, -20.5, 0], [1, 2, 3], [0, 0, 0], [-3600, 10, 60]])
    np.testing.assert_allclose(errors_of(tmp_path, bx40e, ERRORS), expected)
    header, *rows = ERRORS.splitlines()
    shuffled = "\n".join(["# from the coordinate measuring machine", header, *rows[::-1], ""])
    np.testing.assert_array_equal(errors_of(tmp_path, bx40e, shuffled), errors_of(tmp_path, bx40e, ERRORS))
    turned = "z [arcsec],part,y [arcsec],x [arcsec]\n3,KC2,2,1\n0,KC1,-20.5,10\n60,KC4,10,-3600\n0,KC3,0,0\n"
    np.testing.assert_allclose(errors_of(tmp_path, bx40e, turned), expected)


def test_measured_errors_come_as_spreadsheets_write_them(tmp_path, bx40e):
    plain = errors_of(tmp_path, bx40e, ERRORS)
    np.testing.assert_array_equal(errors_of(tmp_path, bx40e, ERRORS, "utf-8-sig"), plain)
    np.testing.assert_array_equal(errors_of(tmp_path, bx40e, ERRORS.replace("x [arcsec]", "X [Arcsec]")), plain)
    semicolons = ERRORS.replace(",", ";").replace("\n", ";\r\n")
    np.testing.assert_array_equal(errors_of(tmp_path, bx40e, semicolons, "utf-8-sig"), plain)


def test_a_perfect_assembly_may_be_measured(tmp_path, bx40e):
    assert not errors_of(tmp_path, bx40e, re.sub(r"(KC\d),.*", r"\1,0,0,0", ERRORS)).any()


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        *(
            (
                "y [arcsec]",
                f"y{unit}",
                f"FILE: the unit of column 'y{unit}' is {unit.strip(' []')!r}; allowed is arcsec in square brackets.",
            )
            for unit in (" [deg]", " [rad]", " [arcmin]", "")
        ),
        ("part,", "part [mm],", "FILE: the unit of column 'part [mm]' is 'mm'; allowed is none."),
        (
            "z [arcsec]",
            "x [arcsec]",
            "FILE: the header is 'part, x [arcsec], y [arcsec], x [arcsec]'; allowed is part, x [arcsec], y [arcsec], "
            "z [arcsec].",
        ),
        ("KC3", "KC5", "FILE, row 4: unknown part 'KC5'; the nearest known are KC4, KC3, KC2."),
        ("KC3,0,0,0\n", "", "FILE: part KC3 is missing; allowed is one row for each of KC1, KC2, KC3, KC4."),
        (
            "KC3",
            "KC2",
            "FILE, row 4: part is 'KC2'; allowed is each part once, and this one stands further up too.",
        ),
        (
            "1,2,3",
            "1,two,3",
            "FILE, row 3 (part KC2): y [arcsec] is 'two'; allowed is a number with a decimal point from -3600 to 3600.",
        ),
        (
            "1,2,3",
            "1,,3",
            "FILE, row 3 (part KC2): y [arcsec] is ''; allowed is a number with a decimal point from -3600 to 3600.",
        ),
        (
            "1,2,3",
            "1,2,nan",
            "FILE, row 3 (part KC2): z [arcsec] is 'nan'; allowed is a number with a decimal point from -3600 to 3600.",
        ),
        (
            "-3600",
            "-3601",
            "FILE, row 5 (part KC4): x [arcsec] is '-3601'; allowed is a number with a decimal point from -3600 to "
            "3600.",
        ),
        (
            "1,2,3",
            "1,5,2,5,3",
            "FILE, row 3: 6 cells stand under 4 headers; numbers have a decimal point, and cells are separated by ','.",
        ),
        (
            "1,2,3",
            "1,2",
            "FILE, row 3: 3 of 4 cells are there; the columns must be of equal length, and a cell without a number is "
            "left empty between its separators.",
        ),
    ],
)
def test_errors_that_cannot_be_meant_are_refused(tmp_path, bx40e, old, new, sentence):
    assert old in ERRORS
    with pytest.raises(TolallocError) as refusal:
        errors_of(tmp_path, bx40e, ERRORS.replace(old, new, 1))
    assert str(refusal.value) == sentence.replace("FILE", str(tmp_path / "errors.csv"))


def test_decimal_commas_are_read_between_semicolons_and_refused_between_commas(tmp_path, bx40e):
    text = ERRORS.replace(",", ";").replace(".", ",")
    np.testing.assert_array_equal(errors_of(tmp_path, bx40e, text), errors_of(tmp_path, bx40e, ERRORS))
    with pytest.raises(InputError, match=r"y \[arcsec\] is '-20,5'; allowed is a number with a decimal point"):
        errors_of(tmp_path, bx40e, ERRORS.replace("-20.5", '"-20,5"'))


def test_errors_in_degrees_are_asked_about(tmp_path, bx40e):
    degrees = "part,x [arcsec],y [arcsec],z [arcsec]\nKC1,0.0028,0,0\nKC2,-0.0167,0,0\nKC3,0,0,0\nKC4,0,0.01,0\n"
    with pytest.raises(InputError, match=r"errors\.csv: the largest error is 0\.0167 arcsec; are these degrees\? "):
        errors_of(tmp_path, bx40e, degrees)


def test_a_file_that_is_not_there_is_refused(tmp_path, bx40e):
    with pytest.raises(InputError, match=r"none\.csv: no such file\.$"):
        load_errors(tmp_path / "none.csv", bx40e)
