"""What the page may ask: each request is a name and a record, each answer a record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

from tolalloc.cli.live.design import LiveDesign, names_in
from tolalloc.cli.live.jobs import Job
from tolalloc.cli.live.saving import Saving
from tolalloc.cli.live.session import Session
from tolalloc.cli.live.units import LiveUnits
from tolalloc.exceptions import InputError, UnknownNameError

_TABS = 64
"""Tabs whose latest request is remembered [-]."""


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
            "examined": self._examined,
            "scene": self._scene,
            "sweep": self._sweep,
            "save": self._save,
            "ask": self._ask,
            "state": self._state,
            "stop": self._stop,
        }

    def answer(self, name: str, sent: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a request.

        Raises
        ------
        InputError, UnknownNameError
            A request that is none, or a field of it that is not allowed.
        """
        if name not in self._asked:
            raise UnknownNameError.among("page", "request", name, self._asked)
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
        found = LiveUnits(session=self.session).unit(design, sent.get("unit", 0))
        return {**self.session.priced(design), **found}

    def _units(self, sent: dict[str, Any]) -> dict[str, Any]:
        wanted = self._newest(sent)
        return self.session.units(self._read(sent), sent.get("units", 256), wanted) or {"called off": True}

    def _examined(self, sent: dict[str, Any]) -> dict[str, Any]:
        return {"sentences": self.session.examined(self._read(sent))}

    def _scene(self, sent: dict[str, Any]) -> dict[str, Any]:
        swept = (str(sent["source"]), sent.get("share", 0.0)) if "source" in sent else None
        return LiveUnits(session=self.session).scene(self._read(sent), sent.get("unit", 0), swept)

    def _sweep(self, sent: dict[str, Any]) -> dict[str, Any]:
        return LiveUnits(session=self.session).swept(self._read(sent), sent.get("unit", 0), str(sent.get("source")))

    def _save(self, sent: dict[str, Any]) -> dict[str, Any]:
        return Saving(session=self.session, script=self.script).save(self._read(sent), sent.get("name", ""))

    def _ask(self, sent: dict[str, Any]) -> dict[str, Any]:
        held = names_in(sent, "locked", [own.name for own in self.session.prepared.errors.active])
        study = Saving(session=self.session, script=self.script).study(self._read(sent), locked=held)
        names = tuple(own.name for own in self.session.prepared.model.settings)
        tab = self._tab(sent)
        with self._lock:
            if tab in self._jobs:
                self._jobs[tab].stop()
            self._jobs[tab] = Job.asked(str(sent.get("question")), study, names)
        return self._jobs[tab].state

    def _state(self, sent: dict[str, Any]) -> dict[str, Any]:
        job = self._jobs.get(self._tab(sent))
        return job.state if job else {}

    def _stop(self, sent: dict[str, Any]) -> dict[str, Any]:
        job = self._jobs.get(self._tab(sent))
        if job:
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
