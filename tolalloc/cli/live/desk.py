"""What the page may ask: each request is a name and a record, each answer a record; questions run in the background."""

from __future__ import annotations

import os
import re
import shlex
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.metadata import packages_distributions
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any, cast

from tolalloc.cli.live.session import LiveDesign, Session, names_in
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import table_text
from tolalloc.exceptions import InputError, TolallocError, UnknownNameError
from tolalloc.reading.files import write_new
from tolalloc.reading.units import MICROMETRE
from tolalloc.study.duration import durations
from tolalloc.study.prepared import Prepared
from tolalloc.study.questions import questions_of
from tolalloc.study.study import Study

KINDS = ("ranking", "allocation")
_TOLD = ("kind", "stage", "units", "expected", "counted", "told", "solved", "most", "answer", "error")
"""What the page is told of a question in the background."""
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
_TABS = 64
"""Tabs whose latest request is known [-]."""


class _StoppedError(Exception):
    """Nobody wants the answer any more."""


@dataclass
class Job:
    """One question in the background, and its own progress, which can be read at any time."""

    kind: str
    study: Study
    settings: tuple[str, ...]  # Names of the settings that an answer may choose
    stage: str = "begins"
    units: int = 0
    expected: int = 0  # Units of the whole stage; 0 where nobody knows [-]
    counted: str = "units"
    told: str = ""  # What is known already
    solved: int = 0  # Units of all stages [-]
    most: int = 0  # About how many units it solves at most; 0 until that is known [-]
    answer: dict[str, Any] | None = None
    error: str = ""
    began: float = field(default_factory=time.monotonic)
    _stop: Event = field(default_factory=Event)

    @classmethod
    def asked(cls, kind: str, study: Study, settings: tuple[str, ...] = ()) -> Job:
        """Ask a question of a study, at the quick effort."""
        if kind not in KINDS:
            raise InputError.at("page", "question", kind, " or ".join(KINDS))
        job = cls(kind=kind, study=study, settings=settings)
        Thread(target=job._run, daemon=True, name=f"live {kind}").start()
        return job

    def stop(self) -> None:
        """Stop it as soon as the next units are solved."""
        self._stop.set()

    def begin(self, stage: str, units: int = 0, counted: str = "") -> None:
        """Begin a stage of so many units, or of what is counted."""
        self._look()
        self.stage, self.units, self.expected, self.counted = stage, 0, units, counted or "units"

    def advance(self, units: int) -> None:
        """So many more units are solved."""
        self._look()
        self.units += units
        self.solved += units

    def tell(self, sentence: str) -> None:
        """Say what is known already."""
        self.told = sentence

    @property
    def state(self) -> dict[str, Any]:
        """How far it has come, and its answer once there is one."""
        told = {name: getattr(self, name) for name in _TOLD}
        return told | {"seconds": round(time.monotonic() - self.began, 1)}

    def _look(self) -> None:
        if self._stop.is_set():
            raise _StoppedError

    def _run(self) -> None:
        try:
            asked = questions_of((self.kind,), self.study.questions, self.study.place)
            quick = replace(self.study.with_effort("quick"), questions=asked)
            self.most = max((own.units[1] for own in durations(Prepared(study=quick))), default=0)
            answer = self.study.ask(self.kind, "quick", self)
            said = {"sentences": list(answer.sentences), "warnings": list(answer.warnings)}
            self.answer = said | _found(answer, self.settings)
        except _StoppedError:
            self.error = "stopped"
        except TolallocError as error:
            self.error = str(error)
        except Exception:
            self.error = "The program failed; the terminal says where."
            raise


def _found(answer: Any, settings: tuple[str, ...]) -> dict[str, Any]:
    """Return what the page takes over of an answer: shares of the sources, or the zones of the cheapest drawing."""
    from tolalloc.reports.figure import chart

    first = next(iter(answer.figures.values()), None)
    drawn = {"figure": chart(first)} if first else {}
    if answer.kind == "ranking":
        return {**drawn, "shares": {name: 100 * share for name, share in answer.result.share_of_source.items()}}
    result = answer.result
    zones = {own.name: own.zone / MICROMETRE for own in result.drawn_sources if own.zone > 0}
    chosen = {name: float(answer.summary[name]) for name in settings if answer.summary.get(name) is not None}
    found = {"met": bool(result.met), "cost": float(result.cost), "zones": zones, "settings": chosen}
    if (
        result.front and result.front.points
    ):  # Cost against the leading output's limit, as far as the question asked for it
        points = result.front.points
        found["front"] = {"x": [own.limit for own in points], "y": [own.design.cost for own in points]}
    return {**drawn, **found}


def _with_range(source: Source) -> Source:
    """Return a source whose smallest and largest zone take in the one that was tried."""
    if source.zone <= 0:
        return source
    smallest, largest = min(source.minimum, source.zone), max(source.maximum, source.zone)
    return replace(source, minimum=smallest, maximum=largest)


@dataclass(frozen=True, kw_only=True)
class Desk:
    """Where the requests of all tabs arrive; a newer one of a tab calls off its older ones."""

    session: Session
    script: Path
    _latest: dict[str, int] = field(default_factory=dict)
    _jobs: dict[str, Job] = field(default_factory=dict)
    _lock: Lock = field(default_factory=Lock)

    @cached_property
    def _asked(self) -> dict[str, Callable[[dict[str, Any]], dict[str, Any]]]:
        return {
            "study": lambda _: self.session.described,
            "design": self._design,
            "units": self._units,
            "examined": lambda sent: {"sentences": self.session.examined(self._read(sent), sent.get("units"))},
            "scaled": self._scaled,
            "scene": self._scene,
            "sweep": self._sweep,
            "save": lambda sent: self._save(self._read(sent), sent.get("name", "")),
            "ask": self._ask,
            "state": lambda sent: job.state if (job := self._jobs.get(self._tab(sent))) else {},
            "stop": self._stop,
        }

    def answer(self, name: str, sent: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a request."""
        UnknownNameError.require("page", "request", name, self._asked)
        return self._asked[name](sent)

    def stop(self) -> None:
        """Stop what runs in the background."""
        for job in self._jobs.values():
            job.stop()

    def _read(self, sent: dict[str, Any]) -> LiveDesign:
        return LiveDesign.read(sent.get("design", {}), self.session.prepared)

    def _design(self, sent: dict[str, Any]) -> dict[str, Any]:
        design = self._read(sent)
        self._newest(sent)  # what older designs still solve is not wanted any more
        found = self.session.unit(design, sent.get("unit", 0))
        return {**self.session.priced(design), **found}

    def _units(self, sent: dict[str, Any]) -> dict[str, Any]:
        wanted = self._newest(sent)
        return self.session.units(self._read(sent), sent.get("units", 256), wanted) or {"called off": True}

    def _scaled(self, sent: dict[str, Any]) -> dict[str, Any]:
        wanted = self._newest(sent)
        found = self.session.scaled(self._read(sent), wanted)
        return {"called off": True} if found is None else {"designs": found}

    def _scene(self, sent: dict[str, Any]) -> dict[str, Any]:
        swept = (str(sent["source"]), sent.get("share", 0.0)) if "source" in sent else None
        return self.session.scene(self._read(sent), sent.get("unit", 0), swept)

    def _sweep(self, sent: dict[str, Any]) -> dict[str, Any]:
        return self.session.swept(self._read(sent), sent.get("unit", 0), str(sent.get("source")))

    def _study(self, design: LiveDesign, name: str = "", locked: frozenset[str] = frozenset()) -> Study:
        """Return the study at a design, with further sources locked."""
        before = self.session.prepared.study
        if before.drawing is None:
            raise InputError(f"study {before.name}: it has no drawing that could change.")
        sources = (replace(own, locked=own.locked or own.name in locked) for own in self.session.sources(design))
        drawing = before.drawing.with_sources(sources)
        return cast("Study", before.changed(drawing, self._settings(design), name))

    def _settings(self, design: LiveDesign) -> dict[str, float]:
        """Return the settings and operating conditions that differ from the study's own."""
        known = zip(self.session.prepared.model.settings, design.settings, strict=True)
        return {own.name: value for own, value in known if value != own.value} | dict(design.operating)

    def _save(self, design: LiveDesign, name: str) -> dict[str, Any]:
        """Write tolerance table and study of a design beside the script, never over a file, and return their names."""
        if not (isinstance(name, str) and _NAME.fullmatch(name)):
            raise InputError.at("page", "name", name, "60 letters, digits and _, a letter first")
        table, script = (self.script.parent / f"{name}{ending}" for ending in (".tolerances.csv", ".py"))
        for path in (table, script):
            if path.exists():
                raise InputError(f"{path.name}: already exists in the folder of the study; choose another name.")
        # A script imports what lies beside it first: a saved numpy.py would take the place of NumPy.
        if name in {"tolalloc", *sys.stdlib_module_names, *packages_distributions()}:
            raise InputError.at("page", "name", name, "what no installed Python module is called")
        drawing, before = self._study(design, name).drawing, self.session.prepared
        sources, values = tuple(map(_with_range, drawing.sources if drawing else ())), self._settings(design)
        write_new(table, table_text(sources, table.parent, before.currency))
        try:  # a table that no study would read, such as one with a zone that the model does not believe, is taken back
            _ = (prepared := Prepared(study=before.study.changed(table, values))).model, prepared.space
        except TolallocError:
            table.unlink()
            raise
        text = _SCRIPT.format(
            before=before.study.name, module=self.script.stem, table=table.name, settings=values, name=name
        )
        write_new(script, text)
        # As it may be pasted into a command line, from whatever folder.
        quoted = f'"{script}"' if os.name == "nt" else shlex.quote(str(script))
        return {"table": table.name, "script": script.name, "command": f"tolalloc run {quoted}"}

    def _ask(self, sent: dict[str, Any]) -> dict[str, Any]:
        held = names_in(sent, "locked", [own.name for own in self.session.prepared.errors.active])
        study = self._study(self._read(sent), locked=held)
        names = tuple(own.name for own in self.session.prepared.model.settings)
        tab = self._tab(sent)
        with self._lock:
            if tab in self._jobs:
                self._jobs[tab].stop()
            self._jobs[tab] = Job.asked(str(sent.get("question")), study, names)
        return self._jobs[tab].state

    def _stop(self, sent: dict[str, Any]) -> dict[str, Any]:
        if job := self._jobs.get(self._tab(sent)):
            job.stop()
        return {}

    def _tab(self, sent: dict[str, Any]) -> str:
        tab = sent.get("tab")
        if not (isinstance(tab, str) and 0 < len(tab) <= 40):
            raise InputError.at("page", "tab", tab, "a name of up to 40 letters")
        return tab

    def _newest(self, sent: dict[str, Any]) -> Callable[[], bool]:
        """Note the number of a tab's request, and return whether it is still the newest one."""
        tab, turn = self._tab(sent), sent.get("turn")
        if type(turn) is not int:
            raise InputError.at("page", "turn", turn, "the number of the request")
        with self._lock:
            self._latest[tab] = max(turn, self._latest.pop(tab, turn))
            while len(self._latest) > _TABS:
                self._latest.pop(next(iter(self._latest)))
        return lambda: self._latest.get(tab, turn) <= turn
