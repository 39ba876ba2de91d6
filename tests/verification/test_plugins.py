"""What other packages bring by entry points: found by name, or left out with one sentence that names the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tolalloc as ta
from tests.studies.command import process
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading import plugins as module
from tolalloc.reading.files import shipped_files
from tolalloc.reading.plugins import plugin_versions, plugins
from tolalloc.reducers.families.records import SHIPPED, records
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.reducers.response.outputs import requirements_of
from tolalloc.reports.writer import versions
from tolalloc.study.questions import questions_of
from tolalloc.wings import wings


def install(folder: Path, package: str, code: str, **entries: str) -> Path:
    """Install a package of one module of its name by hand; entries are group → name = object."""
    about = folder / f"{package}-1.2.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.2\n", "utf-8")
    lines = (f"[tolalloc.{group}]\n{stated}\n" for group, stated in entries.items())
    (about / "entry_points.txt").write_text("".join(lines), "utf-8")
    (folder / package).mkdir()
    (folder / package / "__init__.py").write_text(code, "utf-8")
    return folder / package


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder that packages are installed into; nothing is remembered of others."""
    monkeypatch.syspath_prepend(tmp_path)

    def forget() -> None:
        module._entries.cache_clear()
        module.say_left_out.cache_clear()
        records.cache_clear()

    forget()
    yield tmp_path
    forget()


def test_a_package_brings_a_model_and_stands_in_the_manifest(site):
    code = "import tolalloc as ta\nSUM = ta.model(lambda a, b: a + b, ('a', 'b'), ('sum [mm]',), name='sum')"
    install(site, "acme_model", code, models="sum = acme_model:SUM")
    assert ta.installed_model("sum").outputs == ("sum [mm]",)
    assert plugin_versions() == {"acme_model": "1.2"}
    assert versions()["acme_model"] == "1.2"
    with pytest.raises(UnknownNameError, match=r"unknown model 'summ'; the nearest known is sum"):
        ta.installed_model("summ")


def test_a_package_brings_a_question_that_a_study_does_not_name(site):
    code = """
import tolalloc as ta
class Own(ta.Question):
    kind = "own"
    def answer(self, prepared, record): ...
"""
    install(site, "acme_question", code, questions="any = acme_question:Own")
    (found,) = questions_of(("own",), (), "here")
    assert found.kind == "own"


def test_a_package_brings_an_output_of_every_reducer(site):
    code = """
from tolalloc.reducers.response.outputs import Reading
OWN = Reading(outputs=("own [arcsec]",), read=lambda kernel, errors: None)
"""
    install(site, "acme_output", code, outputs="any = acme_output:OWN")
    assert requirements_of(load_reducer("rv20e"))[-1].outputs == ("own [arcsec]",)


@pytest.mark.parametrize(
    ("read", "why"),
    [
        (
            "1 / 0",
            r"output own \[arcsec\] of another package: its code fails \(ZeroDivisionError: division by zero\)\.",
        ),
        ("None", r"its code fails \(TypeError: 'NoneType' object is not iterable\)\."),
        ("(errors[:, :2], errors[:, 0])", r"shape of values and status is .*; allowed is \(\(3, 1\), \(3,\)\)\."),
    ],
)
def test_an_output_of_a_package_that_fails_is_one_sentence(site, read, why):
    package = f"acme_{site.name}"
    code = f"""
from tolalloc.reducers.response.outputs import Reading
OWN = Reading(outputs=("own [arcsec]",), read=lambda kernel, errors: {read})
"""
    install(site, package, code, outputs=f"any = {package}:OWN")
    found = requirements_of(load_reducer("rv20e"))[-1]
    row = {"id": "pin.diameter", "plus": 2, "minus": -2, "unit": "µm", "min": 1, "max": 9, "cost": 1}
    model = ta.reducer("rv20e", neglected=["*"]).bound(ta.Drawing.of_rows([row]).errors, "test")
    with pytest.raises(InputError, match=why):
        found.read(model.kernel, np.zeros((3, len(model.kernel.model.columns))))


@pytest.mark.parametrize(
    ("group", "code", "why"),
    [
        ("outputs", "outputs, read = ('a',), None", "{package}:Like is no Reading"),
        ("questions", "kind, answer = 'own', None", "{package}:Like is no Question"),
        ("wings", "questions, samples, schemas = (), {}, {}", "{package}:Like is no Wing"),
    ],
)
def test_what_is_of_another_kind_is_left_out(site, caplog, group, code, why):
    package = f"acme_{site.name}"
    install(site, package, f"class Like: {code}", **{group: f"mine = {package}:Like"})
    wings.cache_clear()
    asked = {
        "outputs": lambda: requirements_of(load_reducer("rv20e")),
        "questions": lambda: questions_of(("ranking",), (), "here"),
        "wings": wings,
    }
    assert all(getattr(own, "__module__", "") != package for own in asked[group]())
    wings.cache_clear()
    said = why.format(package=package)
    assert caplog.messages == [f"{package} 1.2: 'mine' of tolalloc.{group} is left out: TypeError: {said}."]


def test_a_package_brings_presets_and_none_of_a_shipped_name(site, caplog):
    folder = install(site, "acme_files", "", files="any = acme_files")
    text = (PRESETS / "rv20e.reducer.toml").read_text("utf-8")
    for name in ("acme1", "rv20e"):
        (folder / f"{name}.reducer.toml").write_text(text.replace("RV-20E", "own"), "utf-8")
    assert load_reducer("acme1").name == "own"
    assert load_reducer("rv20e").name == "RV-20E"
    assert shipped_files(PRESETS, ".reducer.toml")["acme1"].parent == folder
    (said,) = caplog.messages
    assert said == f"{folder / 'rv20e.reducer.toml'} is left out: a file of that name is known already."


FAMILY = "class Like:\n    name, record, interfaces, new = {name!r}, None, (), None\n"


@pytest.mark.parametrize(
    ("code", "why"),
    [
        ("import nothing_of_that_name", "ModuleNotFoundError: No module named 'nothing_of_that_name'"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("raise ValueError('first line\\nsecond line')", "ValueError: first line"),
        ("", "AttributeError: module '{package}' has no attribute 'Like'"),
        ("class Like: name = 'x'", "TypeError: {package}:Like has no record, interfaces, new"),
        (FAMILY.format(name="RV"), "ValueError: RV is known already, give it another name"),
        ("def Like(): def", "SyntaxError: invalid syntax (__init__.py, line 1)"),
    ],
)
def test_what_cannot_be_used_is_left_out_with_one_sentence(site, caplog, code, why):
    package = f"acme_{site.name}"
    install(site, package, code, families=f"mine = {package}:Like")
    for _ in range(2):
        records.cache_clear()
        assert records() == SHIPPED
    assert caplog.messages == [
        f"{package} 1.2: 'mine' of tolalloc.families is left out: {why.format(package=package)}."
    ]


TAKES_ALL = """
from dataclasses import replace
from tolalloc.reducers.families.rv import RV
Like = replace(RV, name={name!r})
"""


@pytest.mark.parametrize(
    ("name", "why"),
    [("own", "ValueError: its record is of the family 'RV', not of 'own'")],
)
def test_a_family_that_would_take_the_files_of_another_is_left_out(site, caplog, name, why):
    install(site, f"acme_{name}", TAKES_ALL.format(name=name), families=f"mine = acme_{name}:Like")
    assert records() == SHIPPED
    assert load_reducer("rv20e").family == "RV"
    assert caplog.messages == [f"acme_{name} 1.2: 'mine' of tolalloc.families is left out: {why}."]


def test_a_folder_without_a_module_brings_presets_too(site):
    folder = install(site, "acme_folder", "", files="any = acme_folder")
    (folder / "__init__.py").unlink()
    (folder / "acme2.reducer.toml").write_text((PRESETS / "rv20e.reducer.toml").read_text("utf-8"), "utf-8")
    assert load_reducer("acme2").name == "RV-20E"


def test_a_command_that_is_known_is_no_wing_of_another_package(tmp_path):
    code = """
from tolalloc.study.inquiries import INQUIRIES
from tolalloc.study.wing import Wing
WING = Wing(questions=(INQUIRIES[0],))
"""
    install(tmp_path, "acme_wing", code, wings="mine = acme_wing:WING")
    done = process("schema", "unit", PYTHONPATH=str(tmp_path))
    assert done.returncode == 0
    assert "is known already, give it another word" in done.stderr


def test_of_two_packages_with_one_name_the_first_is_taken(site, caplog):
    for package in ("acme_second", "acme_first"):
        install(site, package, f"class Like:\n    name, bound = {package!r}, None\n", models=f"same = {package}:Like")
    assert plugins("models", (), ("bound",))["same"].name == "acme_first"
    assert "acme_second 1.2" in caplog.text
    assert "known already" in caplog.text


def test_a_broken_package_stops_no_command(tmp_path):
    install(tmp_path, "acme_wing", "1 / 0", wings="mine = acme_wing:WING")
    done = process("schema", "unit", PYTHONPATH=str(tmp_path))
    assert done.returncode == 0
    assert done.stderr == (
        "acme_wing 1.2: 'mine' of tolalloc.wings is left out: ZeroDivisionError: division by zero.\n"
    )
