"""A question that needs no study gives the same answer to who calls ``ta`` and to who types the command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import shop_file, written
from tests.golden.record import steady
from tests.studies.command import answer_of, tolalloc
from tolalloc.exceptions import InputError, TolallocError

RV40E = {"reducer": "rv40e_xi2015"}
SHORT = {"speed": 5250, "ramp": 0.02, "duration": 0.06, "step": 1e-5}


def same(word: str, *positional: object, typed: str = "", **named: object) -> ta.Answer:
    """Return what ``ta`` answers, once the command with the same words says the same.

    The options of the command are those of ``typed``, and one for each named argument.
    """
    answer = getattr(ta, word)(*positional, **named)
    given = [part for name, value in named.items() if value is not True for part in (f"--{name}", value)]
    assert _plain(answer.summary) == _plain(answer_of(word, *positional, *given, *typed.split()))
    return answer


def _plain(summary: dict[str, Any]) -> Any:
    """Return a summary as a program reads it, without what no two runs have in common."""
    return json.loads(steady(json.dumps(summary, ensure_ascii=False), Path("/")))


@pytest.fixture
def shop(tmp_path):
    return shop_file(tmp_path / "shop.csv")


def test_costs(shop):
    answer = same("costs", shop)
    assert [fit.process for fit in answer.result] == ["ground"]


def test_lot(tmp_path):
    path = tmp_path / "lot.csv"
    path.write_text("pin.diameter [µm]\n" + "".join(f"{0.6 + at / 10}\n" for at in range(9)), encoding="utf-8")
    answer = same("lot", path, "rv20e_drawing", seed=2)
    assert [own.name for own in answer.result.moved] == ["pin.diameter"]


@pytest.mark.slow
def test_te():
    answer = same("te", typed="--attribute", reducer="rv20e", unit="table4", attributed=True)
    assert answer.result.attribution is not None
    assert next(iter(answer.header.statuses.values())) == answer.result.equilibria.carrier_angle.size


def test_contact():
    answer = same("contact", **RV40E, torque=-572, phases=1)
    assert answer.result.assessment.single.force.max() == pytest.approx(1144, abs=1)


@pytest.mark.slow
def test_modify():
    answer = same("modify", "li2018", **RV40E, radial=15)
    assert answer.result.best.amounts / 1e-6 == pytest.approx([35.9679, 20.9679], abs=1e-4)


@pytest.mark.slow
def test_simulate():
    answer = same("simulate", **RV40E, **SHORT, torque=-572)
    assert answer.result.ratio == pytest.approx(81, rel=1e-5)


@pytest.fixture(scope="module")
def mine(tmp_path_factory):
    """Return the files of a new folder: a bench, a unit, an assembly, parts and their reducer."""
    folder = tmp_path_factory.mktemp("same") / "mine"
    done = tolalloc("new", folder, "--like", "rv40e", "--cranks", 3, "--with", "all")
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_identify(mine):
    names = ["crank_disc_bearing=1e8:1e9", "carrier_bearing"]
    typed = f"--parameter {names[0]} --parameter {names[1]} --reducer {mine / 'reducer.toml'}"
    answer = ta.identify(mine / "bench.toml", reducer=str(mine / "reducer.toml"), parameters=names)
    assert _plain(answer.summary) == _plain(answer_of("identify", mine / "bench.toml", *typed.split()))
    assert [item.parameter.symbol for item in answer.result.estimates] == ["K_pd", "K_ca"]


def test_identify_from_the_catalogue(tmp_path):
    files = [tmp_path / f"{name}.stiffness.toml" for name in ("scripted", "typed")]
    answer = ta.identify(reducer="rv20e", catalogue=True, write_to=files[0])
    assert _plain(answer.summary) == _plain(
        answer_of("identify", "--catalogue", "--reducer", "rv20e", "--write", files[1])
    )
    assert files[0].read_bytes() == files[1].read_bytes()
    assert 1.0 < answer.result.factor < 1.5


@pytest.mark.slow
@pytest.mark.push
def test_diagnose(mine):
    lines = (mine / "unit7.csv").read_text(encoding="utf-8").splitlines()
    first = next(at for at, line in enumerate(lines) if line[:1].isdigit())
    few = mine / "few.csv"  # every twelfth reading, to be short, and few sources
    few.write_text("\n".join([*lines[:first], *lines[first::12], ""]), encoding="utf-8")
    zones = pd.read_csv(mine / "zones.csv", dtype=str, keep_default_na=False)
    still = ~zones["id"].isin(("housing.pitch", "disc1.pitch", "pin.diameter"))
    zones.loc[still, ["plus [unit]", "minus [unit]", "locked"]] = ["0", "0", "yes"]
    zones.to_csv(mine / "varied.csv", index=False)
    answer = same("diagnose", few, reducer=str(mine / "reducer.toml"), tolerances=str(mine / "varied.csv"))
    assert "pitch of the housing is bad" in lines[0]
    assert answer.result.diagnosis.named[0] == "housing.pitch"  # a random search may leave others less likely


@pytest.mark.slow
def test_assemble(mine):
    answer = same("assemble", str(mine / "chain.toml"), measured=mine / "angles.csv", precision=5)
    assert answer.result.measured.name == "angles"


@pytest.mark.slow
def test_mount(mine):
    answer = same("mount", mine / "parts.csv", reducer=str(mine / "reducer.toml"), starts=1)
    assert answer.result.found.after.mean() <= answer.result.chance.means.mean()


@pytest.mark.parametrize(
    ("word", "given", "said"),
    [
        ("te", {"torque": 0}, "ta.te: torque is 0.0; allowed is -1670 to 1670 N·m, but not 0."),
        ("te", {"torque": "rated"}, "ta.te: torque is 'rated'; allowed is a number."),
        ("te", {"attributed": 1}, "ta.te: attributed is 1; allowed is True or False."),
        ("contact", {"phases": 0}, "ta.contact: phases is 0; allowed is 1 to 3600."),
        ("contact", {"phases": 1.5}, "ta.contact: phases is 1.5; allowed is a whole number."),
        ("contact", {"width": 0}, "ta.contact: width is 0.0; allowed is 0.5 to 200 mm."),
        ("modify", {"method": "li2018", "radial": -5}, "ta.modify: radial is '-5 µm'; allowed is 0 to 1000 µm."),
        ("simulate", {"torque": 5}, "ta.simulate: torque is 5.0; allowed is -1670 N·m to below 0"),
        ("simulate", {"speed": 0}, "ta.simulate: speed is 0.0; allowed is a number above 0."),
        ("costs", {"shop": 3}, "ta.costs: shop is 3; allowed is a path."),
        ("duty", {"cycle": 3}, "ta.duty: cycle is 3; allowed is a path."),
        ("duty", {"cycle": "cycle.csv", "resistance": -1}, "ta.duty: resistance is -1.0; allowed is 0 to 10 K/W."),
        (
            "identify",
            {"data": "bench.toml", "parameters": "K_pd"},
            "ta.identify: parameters is 'K_pd'; allowed is a list",
        ),
        (
            "identify",
            {"data": "bench.toml", "parameters": ["bias=5"]},
            "ta.identify: parameters is 'bias=5'; allowed is",
        ),
        (
            "identify",
            {"data": "bench.toml", "priors": ["bias"]},
            "ta.identify: priors is 'bias'; allowed is NAME=NUMBER",
        ),
        ("diagnose", {"curve": "unit7.csv", "noise": 0}, "ta.diagnose: noise is 0.0; allowed is above 0 up to 60."),
        ("mount", {"parts": "parts.csv", "starts": 0}, "ta.mount: starts is 0; allowed is 1 to 64."),
        ("lot", {"readings": 5, "tolerances": "rv20e_drawing"}, "ta.lot: readings is 5; allowed is a path."),
        (
            "lot",
            {"readings": "lot.csv", "tolerances": "rv20e_drawing", "false_alarms": 0},
            "ta.lot: false_alarms is 0.0; allowed is 0.001 to 0.5.",
        ),
        ("assemble", {"chain": "bx40e", "precision": -1}, "ta.assemble: precision is -1.0; allowed is 0 to 1e+06."),
    ],
)
def test_a_refusal_names_the_argument(word, given, said):
    with pytest.raises(InputError) as error:
        getattr(ta, word)(**given)
    assert str(error.value).startswith(said)


def test_a_reducer_may_be_a_path():
    from tolalloc.reducers.reducer.files import PRESETS

    found = ta.contact(reducer=PRESETS / "rv40e.reducer.toml", phases=1)
    assert found.result.assessment.reducer.name == "RV-40E"


def test_a_value_without_its_name_or_of_no_field_is_refused():
    with pytest.raises(InputError, match=r"tolalloc te: 'rv20e' stands without its name; write reducer=\.\.\.\."):
        ta.te("rv20e")
    with pytest.raises(InputError, match=r"tolalloc diagnose: curve is missing"):
        ta.diagnose()
    with pytest.raises(TolallocError, match="unknown field 'reductor'; the nearest known is reducer"):
        ta.te(reductor="rv20e")


@pytest.mark.parametrize("given", [{"profile": "disc.csv"}, {"write_to": "new.reducer.toml"}])
def test_no_file_is_written_about_a_reducer_that_nobody_named(given, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"^reducer is missing: where a file is written the reducer must be named"):
        ta.modify("li2018", **given)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_files_are_written_from_a_script_as_from_the_command(tmp_path):
    files = {"profile": str(tmp_path / "disc.csv"), "write_to": tmp_path / "new.reducer.toml"}
    ta.modify("li2018", **RV40E, **files, points=100)
    done = tolalloc("modify", "li2018", *("--reducer", "rv40e_xi2015", "--points", "100"),
                    *("--profile", tmp_path / "typed.csv", "--write", tmp_path / "typed.reducer.toml"))  # fmt: skip
    assert done.returncode == 0, done.stderr
    for ending in (".csv", ".reducer.toml"):
        made, typed = (next(tmp_path.glob(f"{stem}{ending}")).read_bytes() for stem in ("[dn]*", "typed"))
        assert made == typed


OWN = """import tolalloc as ta

row = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}
study = ta.Study(
    ta.model(lambda housing, shaft: housing - shaft, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
    ta.Drawing.of_rows([{"id": "housing", "nominal": 30.1, **row}, {"id": "shaft", "nominal": 30.0, **row}]),
    limits={"gap [mm]": ta.Limit(lower=0.07, upper=0.13)},
    questions=[ta.Allocation(front=False, what_if=False)],
    name="own",
    effort="quick",
)
"""


@pytest.fixture
def script(tmp_path):
    return written(tmp_path / "own.py", OWN)


def test_check(script):
    answer = ta.check(script)
    assert _plain(answer.summary) == _plain(answer_of("check", script))
    assert "\n".join(answer.sentences) == tolalloc("check", script).stdout.rstrip("\n")
    assert answer.summary["questions"] == ["allocation"]


def test_whatif(script):
    answer = ta.whatif(script, {"shaft": 20.0}, units=200)
    assert _plain(answer.summary) == _plain(answer_of("whatif", script, "shaft=0.02mm", "--units", 200))


@pytest.mark.slow
def test_series_and_compare(script, tmp_path):
    answer = ta.series([script], tmp_path / "runs")
    assert answer.summary["studies"][0]["answer"] == "met"
    assert _plain(answer.summary) == _plain(answer_of("series", script, "--out", tmp_path / "runs"))
    runs = [tmp_path / "runs" / "own"] * 2
    compared = ta.compare(*runs)
    assert compared.result.same_question
    assert _plain(compared.summary) == _plain(answer_of("compare", *runs))


def test_new_and_schema(tmp_path):
    made, like = ta.new(tmp_path / "mine", like="rv40e", cranks=3), ("--like", "rv40e", "--cranks", 3)
    (tmp_path / "typed").mkdir()
    assert tolalloc("new", tmp_path / "typed" / "mine", *like).returncode == 0
    for name in ("reducer.toml", "zones.csv", "study.py", "README.md"):
        assert (made / name).read_bytes() == (tmp_path / "typed" / "mine" / name).read_bytes()
    assert ta.schema("reducer") == json.loads(tolalloc("schema", "reducer").stdout)


def test_a_study_itself_is_asked_as_its_script_is(script):
    from tolalloc.study.script import load_script

    study = load_script(script).study
    assert ta.whatif(study, {"shaft": 20.0}, units=200).summary == ta.whatif(script, {"shaft": 20.0}, units=200).summary
    with pytest.raises(InputError, match=r"study: study is 3; allowed is ta\.Study\(\.\.\.\) or the path of a script"):
        ta.check(3)
