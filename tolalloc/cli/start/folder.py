"""A new folder that runs at once: reducer, tolerance table, study, samples, and what to do next."""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp

from tolalloc.cli.start.reducer_text import Likeness
from tolalloc.cli.start.samples import Samples
from tolalloc.cli.start.schema import schema
from tolalloc.cli.start.table import sources_of
from tolalloc.cli.start.workbook import table_workbook
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import table_text
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer

SAMPLES = ("costs", "processes", "cmm", "bench", "curve", "parts", "assembly")
"""Kinds of samples that a folder may have."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,59}")
_USUAL = 60.0
"""Limit of the peak-to-peak where no catalogue value is stated [arcsec]."""
_STUDY = '''"""{name}: which error drives it, and which zones are cheapest."""

import tolalloc as ta

study = ta.Study(
    # Smallest and largest nominal clearance [µm] that the tooth modification may leave on the flank, at tip and root.
    ta.reducer("reducer.toml", flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0)),
    ta.drawing("zones.xlsx"),
    limits={{
        ta.PEAK_TO_PEAK: ta.Limit(upper={limit:g}, show=ta.AtYield(target=0.9973)),
        ta.LOST_MOTION: ta.Limit(upper=1.0),
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
_SAID = {
    "costs": {"shop.csv": "prices of a shop, invented"},
    "processes": {
        "processes.csv": "what processes hold, assumed",
        "process_costs.csv": "ways to make a feature and what each costs, invented",
        "with_processes.py": "the study with these ways to choose from",
    },
    "cmm": {
        "pin_diameters.csv": "measured pins, simulated: name it under `measured`, with `empirical` under `distribution`"
    },
    "bench": {"bench.toml": "curves and loops of two units, simulated; its tables are `bench_….csv`"},
    "curve": {"unit7.csv": "the curve of a bad unit, simulated"},
    "parts": {"parts.csv": "measured parts of two units, simulated"},
    "assembly": {
        "chain.toml": "which part is adjusted against which, as zhang2025 has it",
        "angles.csv": "measured angles of four parts, invented",
    },
}
"""Kind of sample → its files and what they are."""
_ASKED = {
    "costs": "tolalloc costs shop.csv",
    "processes": "tolalloc check with_processes.py",
    "bench": "tolalloc identify bench.toml --reducer reducer.toml",
    "curve": "tolalloc diagnose unit7.csv --reducer reducer.toml --tolerances zones.csv",
    "parts": "tolalloc mount parts.csv --reducer reducer.toml",
    "assembly": "tolalloc assemble chain.toml --measured angles.csv",
}
"""Kind of sample → the command that reads it."""
_SCHEMAS = {"reducer.toml": "reducer", "bench.toml": "bench", "chain.toml": "chain"}
"""File → kind of its schema."""


def _write_schemas(folder: Path) -> None:
    """Write the schemas of a folder's TOML files and name them in their first lines, where editors look."""
    (folder / "schemas").mkdir()
    for file, kind in _SCHEMAS.items():
        if (path := folder / file).exists():
            text = json.dumps(schema(kind), ensure_ascii=False, indent=2)
            (folder / "schemas" / f"{kind}.json").write_text(text + "\n", encoding="utf-8")
            named = f"#:schema ./schemas/{kind}.json\n{path.read_text(encoding='utf-8')}"
            path.write_text(named, encoding="utf-8")


@dataclass(frozen=True, kw_only=True)
class NewFolder:
    """A folder to be made.

    Parameters
    ----------
    place
        Where it will be; its last part names reducer and study.
    like
        What the reducer is like.
    samples
        Kinds of samples, of `SAMPLES`.
    """

    place: Path
    like: Likeness
    samples: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.place.name):
            raise InputError.at("new folder", "name", self.place.name, "60 letters, digits, - and _, a letter first")
        for kind in self.samples:
            if kind not in SAMPLES:
                raise UnknownNameError.among("new folder", "sample", kind, (*SAMPLES, "all"))

    def write(self) -> tuple[Reducer, tuple[Source, ...]]:
        """Write the folder, whole or not at all, and return its reducer and its sources.

        Raises
        ------
        InputError
            Something is there already, or the folder cannot be made.
        """
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
        (folder / "study.py").write_text(_STUDY.format(name=name, limit=round(limit, 6)), encoding="utf-8")
        (folder / "README.md").write_text(self._read_me(), encoding="utf-8")
        if "processes" in self.samples:
            study = (folder / "study.py").read_text(encoding="utf-8")
            files = '"zones.xlsx", processes="processes.csv", costs="process_costs.csv"'
            study = study.replace('"zones.xlsx"', files).replace(f'name="{name}"', f'name="{name}-processes"')
            (folder / "with_processes.py").write_text(study, encoding="utf-8")
        makers = Samples(reducer=reducer, sources=sources).makers if self.samples else {}
        for kind in self.samples:
            for file, text in makers[kind]().items():
                (folder / file).write_text(text, encoding="utf-8")
        _write_schemas(folder)
        return reducer, sources

    def _read_me(self) -> str:
        """Return the page of the folder: what to type, and what every file is."""
        rows = "".join(f"| `{file}` | {what} |\n" for kind in self.samples for file, what in _SAID[kind].items())
        asked = "".join(f"{_ASKED[kind]}\n" for kind in self.samples if kind in _ASKED)
        commands = f"\nOn the samples, some of them for minutes:\n\n```sh\n{asked}```\n" if asked else ""
        return _READ_ME.format(name=self.place.name, samples=rows, commands=commands)
