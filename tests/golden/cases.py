"""The golden cases: every command on the preset, on a reducer of three cranks and on an own function, small or shipped.

A case is one folder and the commands that are typed in it, one after the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import tolalloc as ta

SMALL_EFFORT = """ta.Effort(
        ranking=ta.RankingEffort(
            units=1000, sobol=ta.SobolEffort(start=16, limit=16, resamples=50),
            derivative_units=10, inverse_units=1, surrogate_units=96, level_units=100, level_runs=2, widened_units=100,
            permutations=2),
        allocation=ta.AllocationEffort(
            verification_units=256, confirmation_units=512, shared_units=16, graded_steps=2, front_limits=(0.95, 1.1),
            front_units=256,
            setting_steps=(2, 2), price_nodes=4, stiffness_units=128, share_blocks=8,
            yields=(0.9, 0.95), error=0.5, front_steps=1, search=ta.SearchEffort(steps=2)),
        is_quick=True)"""


def small_effort() -> ta.Effort:
    """Return the effort of the cases."""
    return eval(SMALL_EFFORT, {"ta": ta})


PRESET = f"""import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020", flank_clearance=(1.0, 5.0), radial_clearance=(5.0, 20.0), unit="table4",
        stiffness="rv20e_table6"),
    ta.drawing("rv20e_table4"),
    limits={{ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.95)), ta.LOST_MOTION: ta.Limit(upper=2.0,
        show=ta.AtYield(target=0.95))}},
    questions=[ta.Ranking(), ta.Allocation(grades=True), ta.Difference(zones={{"pin.diameter": 3, "disc1.*": 8}})],
    name="preset",
    effort={SMALL_EFFORT},
    title_block={{"author": "N. N."}},
)
"""

THREE = f"""import tolalloc as ta

study = ta.Study(
    ta.reducer("mine/reducer.toml", flank_clearance=(1.0, 5.0), radial_clearance=(5.0, 20.0)),
    ta.drawing("mine/zones.xlsx"),
    limits={{ta.PEAK_TO_PEAK: ta.Limit(upper=70.0, show=ta.AtYield(target=0.9)), ta.PRELOAD: None}},
    questions=[ta.Ranking(), ta.Allocation(front=False)],
    name="three",
    effort={SMALL_EFFORT},
)
"""

OWN = f"""import tolalloc as ta


def gap(housing, shaft, ring, press):
    return housing - shaft - ring + 0.1 * press, housing - 0.5 * shaft**2 / 30


SHOWN = ta.AtYield(target=0.95)
ROW = {{"unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}}
study = ta.Study(
    ta.model(gap, inputs=("housing", "shaft", "ring"), outputs=("gap [mm]", "seat [mm]"),
        settings=(ta.Setting(name="press", value=0.2, lower=0.0, upper=1.0, step=0.1),)),
    ta.Drawing.of_rows([
        {{"id": "housing", "nominal": 30.1, "plus": 0.02, "minus": -0.02, **ROW}},
        {{"id": "shaft", "nominal": 25.0, "plus": 0.02, "minus": -0.02, **ROW}},
        {{"id": "ring", "nominal": 5.0, "plus": 0.03, "minus": -0.01, "distribution": "uniform", **ROW}},
    ], costs={{"shaft": [("turned", 0.2, 0.004, 0.02, 0.05), ("ground", 0.8, 0.002, 0.004, 0.02)]}}),
    limits={{"gap [mm]": ta.Limit(lower=0.05, upper=0.2, show=SHOWN), "seat [mm]": ta.Limit(lower=19.6, show=SHOWN)}},
    questions=[ta.Ranking(), ta.Allocation()],
    name="own",
    effort={SMALL_EFFORT},
)
"""


BROKEN = "import tolalloc as ta\nstudy = ta.Study(ta.reducer('rv20e'), ta.drawing('nowhere.csv'), limits={})\n"


def seat(name: str, half: float, gap: str = "housing - shaft") -> str:
    """Return a study of the gap of a seat within ± half [mm]."""
    return f"""import tolalloc as ta


def gap(housing, shaft):
    return {gap}


ROW = {{"unit": "mm", "min": 0.005, "max": 0.1, "plus": 0.02, "minus": -0.02, "cost": 1}}
study = ta.Study(
    ta.model(gap, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
    ta.Drawing.of_rows([{{"id": "housing", "nominal": 30.1, **ROW}}, {{"id": "shaft", "nominal": 30.0, **ROW}}]),
    limits={{"gap [mm]": ta.Limit(lower=0.1 - {half}, upper=0.1 + {half})}},
    questions=[ta.Allocation(front=False, what_if=False)],
    name="{name}",
    effort={SMALL_EFFORT},
)
"""


COMMANDS = (
    *(
        "new",
        "check",
        "open",
        "run",
        "rank",
        "allocate",
        "whatif",
        "series",
        "compare",
        "costs",
        "te",
        "contact",
        "duty",
    ),
    *("modify", "identify", "diagnose", "lot", "assemble", "mount", "simulate", "schema", "doctor"),
)


@dataclass(frozen=True, kw_only=True)
class Case:
    """One folder and the commands that are typed in it.

    Parameters
    ----------
    name
        Name of its golden files.
    files
        Name → text of each file that lies there first.
    commands
        Each command as it is typed; ``@`` before a word stands for the folder.
    wandering
        Pattern of lines that tell of a random search, whose path turns with the last bit of another processor: they are
        compared by ``--check`` alone.
    agreement
        How closely processors agree on its numbers [-], relative; where that is more than 1e-6, absolute too.
    searched
        Whether it allocates by a search over a reducer's units: its path, and so where within its noise it ends, turns
        with the last bit. Another processor than the one that made its files answers within `SEARCHED` of the cost.
    """

    name: str
    files: dict[str, str] = field(default_factory=dict)
    commands: tuple[str, ...]
    wandering: str = r"(?!)"
    agreement: float = 1e-6
    searched: bool = False


SEARCHED = 0.05
"""How closely processors agree on the cost of a searched drawing: liu2020's, quick, is 42.29 on one and 41.03 on
another, the main study's 92.68 and 92.46, whose cost varies as much with the seed [-]."""

PRICES = r"worst prices|in whatever combination|,(yes|no)(,[\d.inf]+,[\d.inf]+)?\"?,?$"
"""Lines that follow the search for the worst prices, cut short after few nodes: what it lost and proved, and the zones
at these prices. Two halves of a process meet where the answer lies, so that the last bit decides which comes first."""

NEW = "new @mine --like rv40e --cranks 3 --with all"
MINE = "--reducer @mine/reducer.toml"

SMALL = (
    Case(name="help", commands=("--help", *(f"{word} --help" for word in COMMANDS))),
    Case(
        name="start",
        commands=(
            "new @yours --cranks 2 --discs 1",
            "check @yours/study.py",
            "new @other --like rv80e --cranks 2 --with curve",
            "new @yours",
            *(f"schema {kind}" for kind in ("unit", "stiffness", "drawing")),  # the others are among what is new
            NEW,
        ),
    ),
    Case(
        name="series",
        files={
            "wide.py": seat("wide", 0.03),
            "tight.py": seat("tight", 0.02),
            "broken.py": seat("broken", 0.02, "float('nan')"),
        },
        commands=(
            "series @wide.py @tight.py @broken.py --out @runs",
            "compare @runs/wide @runs/tight --out @compare",
            "series @wide.py @wide.py --out @twice",
        ),
    ),
    Case(
        name="profile",
        commands=(
            "contact --reducer rv20e --phases 4 --profile @teeth.csv --points 8",
            "contact --reducer rv40e --law table2 --exact --width 9 --profile @teeth.dxf",
            "contact --reducer rv20e --support 20 --profile @teeth.stl",
        ),
    ),
)
"""Cases of the default tests."""

LONGER = (
    Case(
        name="catalogue",
        commands=(
            "identify --catalogue --reducer rv40e --write @stiffness.toml --out @identify",
            "te --reducer rv40e --stiffness @stiffness.toml",
        ),
    ),
    Case(
        name="own",
        files={"own.py": OWN, "broken.py": BROKEN},
        commands=(
            "check @own.py",
            "run @own.py --out @run",
            "allocate @own.py --grades --out @graded",
            "compare @run @graded",
            "rank @own.py --json --out @rank",
            "whatif @own.py shaft=0.02",
            "check @broken.py",
        ),
        searched=True,
    ),
    Case(
        name="reducer_questions",
        commands=(
            NEW,
            "check @mine/study.py",
            "te --reducer rv20e --unit table4 --attribute --out @te",
            f"te {MINE}",
            f"contact {MINE} --out @contact",
            f"duty @mine/cycle.csv {MINE} --out @duty",
            f"modify li2018 {MINE} --radial 15 --out @modify",
            "assemble @mine/chain.toml --measured @mine/angles.csv --out @assemble",
            "assemble bx40e",
            "costs @mine/shop.csv --out @costs",
            "lot @mine/lot.csv @mine/zones.csv --write @lot.csv --out @lot",
            "te --reducer rv21e",
        ),
    ),
    Case(
        name="preset",
        searched=True,
        agreement=1e-4,  # grades begin where an early step of the search stood
        wandering=PRICES,
        files={"preset.py": PRESET},
        commands=(
            "check @preset.py",
            "run @preset.py --out @run",
            "whatif @preset.py pin.diameter=3 disc*.pitch=10",
        ),
    ),
    Case(
        name="three",
        searched=True,
        wandering=PRICES,
        files={"three.py": THREE},
        commands=(NEW, "check @three.py", "run @three.py --out @run"),
    ),
    Case(
        name="bench",
        commands=(
            NEW,
            f"identify @mine/bench.toml {MINE} --out @identify",
            f"mount @mine/parts.csv {MINE} --out @mount",
            "simulate --reducer rv40e_xi2015 --speed 5250 --ramp 0.02 --duration 0.06 --step 1e-5 --torque -572 "
            "--out @simulate",
        ),
    ),
    Case(
        name="written_stiffness",
        commands=(
            "new @mine --with bench",
            f"identify @mine/bench.toml {MINE} --parameter crank_disc_bearing=1e8:1e10 "
            "--parameter pin_contact --prior pin_contact=0.2 --write @stiffness.toml",
            f"te {MINE} --stiffness @stiffness.toml",
        ),
    ),
)
"""Cases of the full gate."""

PUSHED = ("catalogue", "own", "reducer_questions", "bench", "rv20e_allocation")
"""Cases that every push runs, with one short diagnosis one at the least for each question, and the main study."""

SHIPPED = "shipped_{}"
"""Name of the case of a shipped study, which is run quick."""

UNRECORDED = (
    "bores_lower_bound",
    "cd29_ranking",
    "gap_inspection",
    "rv20e_duty",
    "rv20e_load_cases",
    "rv20e_lot",
    "rv20e_processes",
    "rv20e_wear",
    "rv27c_ranking",
    "shimmed_bearing",
    "sorted_pins",
)
"""Shipped studies that are run and looked at, but compared with no golden file."""


WANDERING = {
    "choi2000_clutch": rf'"confirmation,|"answer found": |^ +"tolerances,|units: answer found|{PRICES}',
    "liu2020_allocation_full": PRICES,
    "rv20e_diagnosis": r"\d",
    "song2019_modification": r"genetic|^ +\d+\.\d+,?$",
    "zhang2025_assembly": r"^zhang2025's genetic algorithm|^ +\"[\d.]+,[\d.]+,2,",
}
"""Study → lines that follow a random search: the whole of a search for causes, the amounts of an evolution, its excess
over a certified cost, the worst prices."""
AGREEMENT = dict.fromkeys(
    (
        *("liu2020_allocation", "liu2020_allocation_full", "rv20e_allocation", "choi2000_clutch"),
        "liu2020_identification",
    ),
    1e-4,
)
"""Study → agreement of processors on where a convex program or a fit has its least: the place is flatter than the
value, which agrees to 1e-8, so to the root of that."""


SEARCHED_STUDIES = ("choi2000_clutch", "liu2020_allocation", "liu2020_allocation_full", "rv20e_allocation")


def shipped(study: str) -> Case:
    """Return the case of a shipped study by its file's stem."""
    command = f"run studies/{study}.py --quick --out @run"
    return Case(
        name=SHIPPED.format(study),
        commands=(command,),
        wandering=WANDERING.get(study, Case.wandering),
        agreement=AGREEMENT.get(study, Case.agreement),
        searched=study in SEARCHED_STUDIES,
    )
