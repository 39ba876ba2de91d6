"""A design as files: its tolerance table and a study that the command line confirms to the last digit."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tolalloc.cli.live.design import LiveDesign
from tolalloc.cli.live.session import Session
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import table_text
from tolalloc.exceptions import InputError, TolallocError
from tolalloc.reading.files import write_new
from tolalloc.study.prepared import Prepared
from tolalloc.study.study import Study

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,59}")
_SCRIPT = '''"""{before} at other zones, saved from the live page."""

from importlib import import_module

import tolalloc as ta

study = import_module("{module}").study.changed(
    "{table}",
    settings={settings!r},
    name="{name}",
)

if __name__ == "__main__":
    ta.run_script()
'''


@dataclass(frozen=True, kw_only=True)
class Saving:
    """Where designs of a session are written: beside the study's script, never over a file."""

    session: Session
    script: Path

    def study(self, design: LiveDesign, name: str = "", locked: frozenset[str] = frozenset()) -> Study:
        """Return the study at a design, with further sources locked."""
        before = self.session.prepared.study
        if before.drawing is None:
            raise InputError(f"study {before.name}: it has no drawing that could change.")
        sources = (replace(own, locked=own.locked or own.name in locked) for own in self.session.sources(design))
        drawing = before.drawing.with_sources(sources)
        return before.changed(drawing, self._settings(design), name)

    def save(self, design: LiveDesign, name: str) -> dict[str, Any]:
        """Write the tolerance table and the study of a design, and return their names.

        Raises
        ------
        InputError
            A name that is none of a Python module, or files that are there already.
        """
        if not (isinstance(name, str) and _NAME.fullmatch(name)):
            raise InputError.at("page", "name", name, "60 letters, digits and _, a letter first")
        table, script = (self.script.parent / f"{name}{ending}" for ending in (".tolerances.csv", ".py"))
        for path in (table, script):
            if path.exists():
                raise InputError(f"{path.name}: is there already in the folder of the study; choose another name.")
        drawing, currency = self.study(design, name).drawing, self.session.prepared.currency
        sources = tuple(map(_with_range, drawing.sources if drawing else ()))
        write_new(table, table_text(sources, table.parent, currency))
        self._require_readable(table, design)
        before = self.session.prepared.study.name
        values = self._settings(design)
        text = _SCRIPT.format(before=before, module=self.script.stem, table=table.name, settings=values, name=name)
        write_new(script, text)
        return {"table": table.name, "script": script.name, "folder": str(self.script.parent)}

    def _require_readable(self, table: Path, design: LiveDesign) -> None:
        """Take a table back that no study would read, such as one with a zone that the model does not believe."""
        try:
            changed = self.session.prepared.study.changed(table, self._settings(design))
            _ = (prepared := Prepared(study=changed)).model, prepared.space
        except TolallocError:
            table.unlink()
            raise

    def _settings(self, design: LiveDesign) -> dict[str, float]:
        """Return the settings and operating conditions that differ from the study's own."""
        known = zip(self.session.prepared.model.settings, design.settings, strict=True)
        return {own.name: value for own, value in known if value != own.value} | dict(design.operating)


def _with_range(source: Source) -> Source:
    """Return a source whose smallest and largest zone take in the one that was tried."""
    if source.zone <= 0:
        return source
    smallest, largest = min(source.minimum, source.zone), max(source.maximum, source.zone)
    return replace(source, minimum=smallest, maximum=largest)
