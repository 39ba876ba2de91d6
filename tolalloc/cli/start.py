"""A new folder that runs at once: reducer, tolerance table, study, samples, schemas for editors, what to do next."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any

from pydantic import BaseModel

from tolalloc.cli.samples import samples
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.drawing import load_drawing
from tolalloc.drawings.fields import COLUMNS, headers_in
from tolalloc.drawings.ladder import tolerance_factor
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_rows, table_text
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import shipped_or_path
from tolalloc.reading.units import ARCSECOND, COST_UNITS, MICROMETRE, MILLIMETRE
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.sources import ErrorSource
from tolalloc.reducers.families.family import NewRows
from tolalloc.reducers.families.known import FAMILIES, SOURCES, family_of
from tolalloc.reducers.reducer.design import Modification, Reducer
from tolalloc.reducers.reducer.files import PRESETS, IdentifiedStiffnessRecord, load_reducer
from tolalloc.reducers.unit_file import UnitRecord
from tolalloc.study.sample import NewReducer, Sample
from tolalloc.wings import wings


def _just(record: type[BaseModel]) -> Callable[[], type[BaseModel]]:
    return lambda: record


KINDS: dict[str, Callable[[], type[BaseModel]]] = {
    **{own.new.schema: _just(own.record) for own in FAMILIES.values()},
    "unit": lambda: UnitRecord,
    "stiffness": lambda: IdentifiedStiffnessRecord,
    **{kind: record for wing in wings() for kind, record in wing.schemas.items()},
}
"""Kind of TOML file → the record that reads it."""
_NUMBERED = re.compile(r"(disc|crank|bore|journal|planet|mesh)\d+")
_CHOICES = {
    "feature": [str(feature.value) for feature in Feature],
    "distribution": [str(own.value) for own in Distribution],
    "unit": ["µm", "mm"],
    "locked": ["yes", "no"],
    "sorted": ["yes", "no"],
    "grade": [f"IT{grade}" for grade in range(1, 12)],
}
"""Column → what may stand there; of a grade, which is carried through, anything else too."""
_SPARE = 200
"""Rows below the table that have the same choices [-]."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,59}")
_USUAL = 60.0
"""Limit of the peak-to-peak where no catalogue value is stated [arcsec]."""
_STUDY = '''"""{name}: which error drives it, and which zones are cheapest."""

import tolalloc as ta

SHIPPED = ta.AtYield(target=0.9973)
# Discs colder and warmer than the ring [K], assumed.
COLD, WARM = ta.LoadCase("cold", disc_temperature=-2.0), ta.LoadCase("warm", disc_temperature=2.0)

study = ta.Study(
    ta.reducer(
        "reducer.toml",
        # Clearances [µm] that the tooth modification may leave on the flank, at tip and root: smallest, largest.
        flank_clearance=(1.0, 12.0),
        radial_clearance=(5.0, 30.0),
        load_cases=(COLD, WARM),
    ),
    ta.drawing("zones.xlsx"),
    limits={{
        ta.PEAK_TO_PEAK: ta.Limit(upper={limit:g}, show=SHIPPED),
        ta.at(ta.LOST_MOTION, COLD): ta.Limit(upper={lost_motion}, show=SHIPPED),
        ta.at(ta.RADIAL_CLEARANCE, WARM): ta.Limit(lower=0.0, show=SHIPPED),
    }},
    questions=[ta.Ranking(), ta.Allocation()],
    name="{name}",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
'''
_READ_ME = """# {name}

Made by `tolalloc new`. In this folder, one after the other:

```sh
tolalloc check study.py
tolalloc open study.py
tolalloc run study.py --quick
```

`check` says what the study reads, and how many random units are preloaded. `open` shows what each zone does, live.
`run` writes `runs/{name}/report.html`: what drives the error, and the cheapest zones. Leave `--quick` out before you
set a drawing.

| file | is |
|---|---|
| `reducer.toml` | the reducer; `assumptions` lists what nobody measured |
| `zones.xlsx` | the tolerance table, a row per source; the study reads this one |
| `zones.csv` | the same as text |
| `study.py` | limits and questions |
| `schemas` | what may stand in the TOML files, for editors that offer it |
{samples}{commands}
Every zone, range and cost is assumed: write your own. A row with zone 0 is neglected.
"""


def schema(kind: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of TOML file.

    Raises
    ------
    UnknownNameError
        There is no such kind.
    """
    UnknownNameError.require("schema", "kind", kind, KINDS)
    record = KINDS[kind]()
    found = record.model_json_schema(by_alias=True)
    for table in (found, *found.get("$defs", {}).values()):
        for own in table.get("properties", {}).values():
            own.pop("title", None)  # pydantic's, the name once more
        if spacing := table.get("properties", {}).get("disc_spacing_mm"):
            del spacing["default"]
            spacing["description"] = "the face width, unless given"
    title = f"{kind} file of tolalloc"
    return {**found, "$schema": "https://json-schema.org/draft/2020-12/schema", "title": title}


@dataclass(frozen=True, kw_only=True)
class Likeness:
    """Which preset a new reducer is like, and how many cranks and discs it has; those of the preset unless given."""

    preset: str = "rv20e"
    cranks: int | None = None
    discs: int | None = None

    def __post_init__(self) -> None:
        presets = [preset for own in FAMILIES.values() for preset in own.new.presets]
        UnknownNameError.require("new reducer", "preset", self.preset, presets)
        for name, count, allowed in (("cranks", self.cranks, self.new.cranks), ("discs", self.discs, self.new.discs)):
            if count is not None and count not in allowed:
                said = f"{allowed[0]} to {allowed[-1]}" if allowed else f"nothing: a {self.family} has none"
                raise InputError.of_argument("new reducer", name, count, said)

    @property
    def family(self) -> str:
        """Name of the preset's family."""
        return next(name for name, own in FAMILIES.items() if self.preset in own.new.presets)

    @property
    def new(self) -> NewRows:
        """What a new folder of the family starts from."""
        return FAMILIES[self.family].new

    @property
    def reducer(self) -> Reducer:
        """The preset itself."""
        return load_reducer(self.preset)

    @property
    def samples(self) -> Mapping[str, Sample]:
        """Kinds of samples that the family has."""
        has_cranks = self.reducer.crank_count > 0
        return {kind: own for kind, own in samples().items() if has_cranks or not own.needs_cranks}

    def kinds(self, samples: str) -> tuple[str, ...]:
        """Return the kinds of samples that are named, separated by commas, or all that the family has."""
        if samples == "all":
            return tuple(self.samples)
        return tuple(kind.strip() for kind in samples.split(",") if kind.strip())

    def text(self, name: str) -> str:
        """Return the reducer file; new counts and the modification of the drawing are marked as assumptions."""
        text = shipped_or_path(self.preset, PRESETS, ".reducer.toml", "reducer").read_text(encoding="utf-8")
        text = re.sub(r'^name = ".*"$', f'name = "{name}"', text, count=1, flags=re.MULTILINE)
        text, changed = self._with_modification(text), []
        for field, count in (("crank_count", self.cranks), ("disc_count", self.discs)):
            if count is None:
                continue
            before = int(re.search(rf"^{field} = (\d+)", text, re.MULTILINE)[1])  # type: ignore[index]
            if count != before:
                text = re.sub(rf"^{field} = \d+", f"{field} = {count}", text, count=1, flags=re.MULTILINE)
                changed.append(f"{field} {count} instead of {before}")
        if changed:
            note = f"{', '.join(changed)}: all parts as in {self.preset}, which has another load on each of them"
            text = text.replace("assumptions = [\n", f'assumptions = [\n  "{note}",\n', 1)
        return f"# Made by tolalloc new, like {self.preset}. Change what you know, and what `assumptions` says.\n{text}"

    def _with_modification(self, text: str) -> str:
        """Return a reducer file with the amounts that leave the clearances of the drawing at this size."""
        amounts = modification_of(self.reducer)
        for field in ("equidistant", "shift"):
            amount = f"{getattr(amounts, field) / MICROMETRE:.1f}"
            text = re.sub(rf"^{field}_um = \S+", f"{field}_um = {amount}", text, count=1, flags=re.MULTILINE)
        flank, radial = clearances_of(self.reducer).values()
        note = (
            f"modification not that of {self.preset}: leaves {flank:g} µm on the flank and {radial:g} µm at tip and "
            f"root, as {self.new.table} does in the proportion of its zones"
        )
        return text.replace("assumptions = [\n", f'assumptions = [\n  "{note}",\n', 1)


def preset_of(family: str, like: str) -> str:
    """Return the preset of a new reducer: the one that is named, or the first of the family."""
    names = {own.word: own.new.presets for own in FAMILIES.values()}
    if family and family not in names:
        raise UnknownNameError.among("new reducer", "family", family, names)
    if family and like and like not in names[family]:
        raise UnknownNameError.among("new reducer", f"preset of the family {family}", like, names[family])
    return like or names[family or "rv"][0]


def sources_of(reducer: Reducer, complete: bool = False) -> tuple[Source, ...]:
    """Return all sources of a reducer with assumed zones.

    Zones and their ranges are those of the family's drawing, such as ``rv20e_drawing``, scaled by the tolerance unit
    i = 0.45·D^(1/3) + 0.001·D of ISO 286-1 with D the diameter of the pin circle in mm. The shipped drawings of larger
    sizes are made by this rule.

    Parameters
    ----------
    complete
        Whether every source has a zone and may change, as in the shipped drawings; or else the first stage is locked,
        and phases, tilts, single pins and teeth are neglected.
    """
    known = {source.name: source for source in load_tolerance_table(family_of(reducer).new.table)}
    scale = _scale_of(reducer)
    kinds = {name: SOURCES.of(name) for name in map(source_name, EquivalentModel(reducer).columns)}
    found = []
    for name, kind in kinds.items():
        like = known.get(name) or known.get(_NUMBERED.sub(r"\g<1>1", name))
        if like is not None and kind is not None:
            part = like.part if like.name == name else name.partition(".")[0]
            own = replace(like, name=name, part=part)
            scaled = _scaled(own, kind, reducer, scale)
            found.append((kind.fine + 2 * kind.first_stage, scaled if complete else _reduced(scaled, kind)))
    return tuple(own for _, own in sorted(found, key=lambda ranked: ranked[0]))


def clearances_of(reducer: Reducer) -> dict[str, float]:
    """Return the clearances of the drawing's modification at this size, by name [µm].

    They are those of the family's drawing in the proportion of the zones, in whole tenths of a micrometre.
    """
    stated = load_drawing(family_of(reducer).new.table).settings
    return {name: round(_scale_of(reducer) * value, 1) for name, value in stated.items()}


def modification_of(reducer: Reducer) -> Modification:
    """Return the amounts that leave the clearances of the drawing at this size, in whole tenths of a micrometre."""
    flank, radial = clearances_of(reducer).values()
    exact = Modification.from_clearances(flank * MICROMETRE, radial * MICROMETRE, reducer.cycloid_stage)
    return Modification(equidistant=_rounded(exact.equidistant), shift=_rounded(exact.shift))


def _scale_of(reducer: Reducer) -> float:
    """Return how much wider zones are than those of the family's drawing: as ISO 286's of the pin circles are [-]."""
    known = family_of(reducer).new.diameter * MILLIMETRE
    return tolerance_factor(2 * reducer.cycloid_stage.pin_circle_radius) / tolerance_factor(known)


def _scaled(source: Source, kind: ErrorSource, reducer: Reducer, scale: float) -> Source:
    """Return a source at this size, its number of like features that of the reducer.

    The length over which an angle is measured grows with the pin circle.
    """
    nominal = kind.nominal.of(reducer) if kind.nominal and not kind.nominal.chosen else 0.0
    zone, least, most = (_rounded(scale * own) for own in (source.zone, source.minimum, source.maximum))
    new = family_of(reducer).new
    longer = 2 * reducer.cycloid_stage.pin_circle_radius / MILLIMETRE / new.diameter
    note = f"zone, range and cost assumed: those of {new.table}, scaled by ISO 286's tolerance unit"
    return replace(
        source,
        zone=zone,
        minimum=least,
        maximum=most,
        each=kind.count(reducer),
        over=round(longer * source.over / MILLIMETRE, 1) * MILLIMETRE,
        nominal=nominal,
        note=note,
    )


def _reduced(source: Source, kind: ErrorSource) -> Source:
    """Return a source as a new folder has it: a fine one is neglected, one of the first stage is locked."""
    if kind.fine:
        source = replace(source, zone=0.0, minimum=0.0, maximum=0.0, cost=0.0, nominal=0.0)
        return replace(source, locked=True, note="neglected: give it a zone")
    if kind.first_stage:
        return replace(source, locked=True, note=f"{source.note}; locked: the first stage is divided by the ratio")
    return source


def _rounded(length: float) -> float:
    """Return a length in whole tenths of a micrometre [m]."""
    return round(length / MICROMETRE, 1) * MICROMETRE


def table_workbook(sources: Sequence[Source]) -> bytes:
    """Return the workbook of a tolerance table."""
    from tolalloc.reports.excel import Book, letter

    book, rows = Book(), table_rows(sources)
    sheet = book.sheet("tolerances")
    for at, (name, head) in enumerate(headers_in(COST_UNITS, sources).items(), start=1):
        cells = [head, *(row[at - 1] for row in rows)]
        for row, value in enumerate(cells, start=1):
            sheet.cell(row, at, value)
        sheet.cell(1, at, bold=True, bg_color="#DDE6F0")
        sheet.inner.write_comment(0, at - 1, COLUMNS[name].meaning, {"author": "tolalloc"})
        sheet.width(at, min(max(len(str(value or "")) for value in cells), 40) + 3)
        if name in _CHOICES:
            allowed = {
                "validate": "list",
                "source": _CHOICES[name],
                "show_error": name != "grade",
                "error_title": name,
                "error_message": f"Allowed are {', '.join(_CHOICES[name])}.",
            }
            sheet.inner.data_validation(f"{letter(at)}2:{letter(at)}{len(cells) + _SPARE}", allowed)
    sheet.inner.freeze_panes(1, 1)
    return book.content()


def _write_schemas(folder: Path, reducer: str) -> None:
    """Write the schemas of a folder's TOML files and name them in their first lines, where editors look.

    That of the reducer is of its family's kind.
    """
    (folder / "schemas").mkdir()
    for path in sorted(folder.glob("*.toml")):
        if (kind := reducer if path.stem == "reducer" else path.stem) in KINDS:
            text = json.dumps(schema(kind), ensure_ascii=False, indent=2)
            (folder / "schemas" / f"{kind}.json").write_text(text + "\n", encoding="utf-8")
            named = f"#:schema ./schemas/{kind}.json\n{path.read_text(encoding='utf-8')}"
            path.write_text(named, encoding="utf-8")


@dataclass(frozen=True, kw_only=True)
class NewFolder:
    """A folder to be made."""

    place: Path  # Where it will be; its last part names reducer and study
    like: Likeness  # What the reducer is like
    samples: tuple[str, ...] = ()  # Kinds of samples, of those that the family has

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.place.name):
            raise InputError.at("new folder", "name", self.place.name, "60 letters, digits, - and _, a letter first")
        for kind in self.samples:
            if kind not in self.like.samples:
                raise UnknownNameError.among("new folder", "sample", kind, (*self.like.samples, "all"))

    @property
    def _asked(self) -> tuple[Sample, ...]:
        return tuple(self.like.samples[kind] for kind in self.samples)

    def write(self) -> tuple[Reducer, tuple[Source, ...]]:
        """Write the folder, whole or not at all, and return its reducer and its sources."""
        if self.place.exists():
            raise InputError(f"{self.place}: is there already; choose another name, nothing is overwritten.")
        above = self.place.absolute().parent
        try:
            above.mkdir(parents=True, exist_ok=True)
            beside = Path(mkdtemp(prefix=f".{self.place.name}-", suffix=".unfinished", dir=above))
        except OSError as error:
            raise InputError(f"{self.place}: the folder cannot be made ({error.strerror}).") from None
        try:
            found = self._fill(beside)
            beside.chmod(0o755)
            os.rename(beside, self.place)
        except BaseException:
            rmtree(beside, ignore_errors=True)
            raise
        return found

    def _fill(self, folder: Path) -> tuple[Reducer, tuple[Source, ...]]:
        name = self.place.name
        (folder / "reducer.toml").write_text(self.like.text(name), encoding="utf-8")
        reducer = load_reducer(folder / "reducer.toml")
        sources = sources_of(reducer)
        (folder / "zones.csv").write_text(table_text(sources, folder), encoding="utf-8")
        (folder / "zones.xlsx").write_bytes(table_workbook(sources))
        limit = reducer.catalogue.transmission_error / ARCSECOND if reducer.catalogue else _USUAL
        study = _STUDY.format(name=name, limit=round(limit, 6), lost_motion=self.like.new.lost_motion)
        (folder / "study.py").write_text(study, encoding="utf-8")
        (folder / "README.md").write_text(self._read_me(), encoding="utf-8")
        if "processes" in self.samples:
            study = (folder / "study.py").read_text(encoding="utf-8")
            files = '"zones.xlsx", processes="processes.csv", costs="process_costs.csv"'
            study = study.replace('"zones.xlsx"', files).replace(f'name="{name}"', f'name="{name}-processes"')
            (folder / "with_processes.py").write_text(study, encoding="utf-8")
        new = NewReducer(reducer=reducer, sources=sources)
        for own in self._asked:
            for file, text in own.make(new).items():
                (folder / file).write_text(text, encoding="utf-8")
        _write_schemas(folder, self.like.new.schema)
        return reducer, sources

    def _read_me(self) -> str:
        """Return the page of the folder: what to type, and what every file is."""
        rows = "".join(f"| `{file}` | {what} |\n" for own in self._asked for file, what in own.files.items())
        asked = "".join(f"{own.command}\n" for own in self._asked if own.command)
        commands = f"\nOn the samples, some of them for minutes:\n\n```sh\n{asked}```\n" if asked else ""
        return _READ_ME.format(name=self.place.name, samples=rows, commands=commands)


def new(
    folder: str | Path, *, like: str = "rv20e", cranks: int | None = None, discs: int | None = None, samples: str = ""
) -> Path:
    """Make a folder with a reducer, its tolerance table, a study and samples, to start from.

    Parameters
    ----------
    folder
        The new folder, whose name becomes that of the study.
    like
        Preset that the reducer is like.
    cranks, discs
        Their numbers; those of the preset unless given [-].
    samples
        Kinds of samples, separated by commas, or ``all``.

    Raises
    ------
    InputError, UnknownNameError
        Something is there already, or a name or number that is not allowed.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> sorted(own.name for own in new(f"{mkdtemp()}/mine", like="rv40e").iterdir())
    ['README.md', 'reducer.toml', 'schemas', 'study.py', 'zones.csv', 'zones.xlsx']
    """
    place, chosen = Path(folder), Likeness(preset=like, cranks=cranks, discs=discs)
    NewFolder(place=place, like=chosen, samples=chosen.kinds(samples)).write()
    return place
