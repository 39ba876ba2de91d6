"""``tolalloc schema``: what an editor is told of a TOML file is what the program reads."""

from __future__ import annotations

import copy
import json
import tomllib

import pytest
import typer
from typer.main import get_command

from tests.studies.command import refused, tolalloc
from tolalloc.cli.main import app
from tolalloc.cli.start import KINDS, schema
from tolalloc.exceptions import TolallocError
from tolalloc.reducers.families.known import FAMILIES, family_of
from tolalloc.reducers.reducer.files import PRESETS, load_reducer
from tolalloc.reducers.reducer.records import ReducerRecord
from tolalloc.wings.assembly.files import DATA, load_plan
from tolalloc.wings.bench.measurements import load_measurements

SHIPPED = {
    "reducer": sorted(PRESETS.glob("*.reducer.toml")),
    "unit": sorted(PRESETS.glob("*.unit.toml")),
    "stiffness": sorted(PRESETS.glob("*.stiffness.toml")),
    "chain": sorted(DATA.glob("*.chain.toml")),
}
TYPES = {"string": str, "integer": int, "boolean": bool, "object": dict, "array": list, "null": type(None)}


def fits(value: object, own: dict, whole: dict) -> bool:
    """Return whether a value is what a schema allows; the words of JSON schema that pydantic writes for our records."""
    if "$ref" in own:
        return fits(value, whole["$defs"][own["$ref"].rsplit("/", 1)[-1]], whole)
    if "anyOf" in own:
        return any(fits(value, one, whole) for one in own["anyOf"])
    if "oneOf" in own:
        return sum(fits(value, one, whole) for one in own["oneOf"]) == 1
    known = {"type", "default", "description", "title", "enum", "minimum", "maximum", "exclusiveMinimum"}
    known |= {"exclusiveMaximum", "minLength", "minItems", "maxItems", "items", "prefixItems", "properties", "required"}
    assert set(own) <= known | {"additionalProperties", "$defs", "$schema"}, own
    kind = own["type"]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number if kind == "number" else isinstance(value, TYPES[kind]) and (kind != "integer" or is_number)):
        return False
    if is_number and not (
        own.get("minimum", value) <= value <= own.get("maximum", value)
        and ("exclusiveMinimum" not in own or value > own["exclusiveMinimum"])
        and ("exclusiveMaximum" not in own or value < own["exclusiveMaximum"])
    ):
        return False
    if "enum" in own and value not in own["enum"]:
        return False
    if kind == "object":
        fields, others = own.get("properties", {}), own.get("additionalProperties", True)
        if any(name not in value for name in own.get("required", ())):
            return False
        return all(
            fits(part, fields.get(name, others), whole) if name in fields or isinstance(others, dict) else others
            for name, part in value.items()
        )
    if kind == "array":
        least, most = own.get("minItems", 0), own.get("maxItems", len(value))
        kinds = own.get("prefixItems") or [own["items"]] * len(value)
        return least <= len(value) <= most and all(map(fits, value, kinds, [whole] * len(value)))
    return len(value) >= own.get("minLength", 0) if isinstance(value, str) else True


@pytest.mark.parametrize(("kind", "path"), [(kind, path) for kind, own in SHIPPED.items() for path in own])
def test_every_shipped_file_is_what_the_schema_allows(kind, path):
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    own = family_of(load_reducer(path)).new.schema if kind == "reducer" else kind
    assert fits(content, schema(own), schema(own))


def test_a_new_folder_names_schemas_that_its_files_fit(tmp_path):
    tolalloc("new", tmp_path / "mine", "--with", "all")
    load_reducer(tmp_path / "mine" / "reducer.toml")
    load_measurements(tmp_path / "mine" / "bench.toml")
    load_plan(tmp_path / "mine" / "chain.toml")
    for path in (tmp_path / "mine").glob("*.toml"):
        text = path.read_text(encoding="utf-8")
        named = text.splitlines()[0].removeprefix("#:schema ")
        known = json.loads((path.parent / named).read_text(encoding="utf-8"))
        assert known == json.loads(tolalloc("schema", path.parent.joinpath(named).stem).stdout)
        assert fits(tomllib.loads(text), known, known)


def changed(data: dict, place: str, value: object) -> dict:
    """Return a file's content with another value in one place; without it where there is none."""
    found = copy.deepcopy(data)
    *tables, name = place.split(".")
    inner = found
    for table in tables:
        inner = inner[int(table)] if isinstance(inner, list) else inner[table]
    if value is None:
        del inner[name]
    else:
        inner[name] = value
    return found


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("crank_count", 7),
        ("crank_count", 2.5),
        ("crank_counts", 2),
        ("first_stage", None),
        ("first_stage.module_mm", 0.05),
        ("first_stage.module_m", 0.001),
        ("stiffness.sun_support", "stiff"),
        ("stiffness.crank_disc_bearing.rollers", 1),
        ("stiffness.pin_contact_law", "linear"),
        ("modification.convention", "both"),
        ("assumptions", "one"),
    ],
)
def test_what_the_schema_refuses_the_program_refuses(place, value):
    data = tomllib.loads((PRESETS / "rv20e.reducer.toml").read_text(encoding="utf-8"))
    ReducerRecord.model_validate(data)
    wrong = changed(data, place, value)
    assert not fits(wrong, schema("reducer"), schema("reducer"))
    with pytest.raises(ValueError, match=place.rsplit(".", 1)[-1]):
        ReducerRecord.model_validate(wrong)


def test_inner_tables_that_are_read_one_by_one_are_in_the_schema_too(tmp_path):
    data = tomllib.loads((DATA / "bx40e.chain.toml").read_text(encoding="utf-8"))
    for place, value in (("part.0.tolerance_arcsec", [30, 30]), ("part.0.cost.form", "linear"), ("part.1.wieght", 1)):
        assert not fits(changed(data, place, value), schema("chain"), schema("chain"))
    path = tmp_path / "mine.chain.toml"
    path.write_text((DATA / "bx40e.chain.toml").read_text(encoding="utf-8").replace("tilts =", "tilt =", 1))
    with pytest.raises(TolallocError, match="tilt"):
        load_plan(path)


def help_of(command: str, at: int) -> str:
    """Return what the help of a command says of an argument or option."""
    found = get_command(app).commands[command]
    return found.get_params(typer.Context(found))[at].help


def test_kinds_are_those_of_the_help_and_another_is_refused():
    assert help_of("schema", 0) == f"Kind of TOML file: {', '.join(KINDS)}."
    refused(tolalloc("schema", "bnch"), "bnch", "bench")


def test_families_and_their_presets_are_those_of_the_help():
    family, like = help_of("new", 1), help_of("new", 2)
    presets = {own.new.schema.replace("reducer", "rv"): ", ".join(own.new.presets) for own in FAMILIES.values()}
    assert family == f"Family of reducers: {', '.join(presets)}; as the preset unless given."
    first, *others = presets.items()
    named = [first[1], *(f"{word}: {own}" for word, own in others)]
    assert like == f"Preset to start from: {'; '.join(named)}."
