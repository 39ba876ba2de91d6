"""Questions that take a while, asked in the background and stopped when nobody wants them any more."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import Any

from tolalloc.exceptions import InputError, TolallocError
from tolalloc.study.study import Study

KINDS = ("ranking", "allocation")


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
    answer: dict[str, Any] | None = None
    error: str = ""
    began: float = field(default_factory=time.monotonic)
    _stop: Event = field(default_factory=Event)

    @classmethod
    def asked(cls, kind: str, study: Study, settings: tuple[str, ...] = ()) -> Job:
        """Ask a question of a study, at the quick effort.

        Raises
        ------
        InputError
            The page does not ask such a question.
        """
        if kind not in KINDS:
            raise InputError.at("page", "question", kind, " or ".join(KINDS))
        job = cls(kind=kind, study=study, settings=settings)
        Thread(target=job._run, daemon=True, name=f"live {kind}").start()
        return job

    def stop(self) -> None:
        """Stop it as soon as the next units are solved."""
        self._stop.set()

    def begin(self, stage: str) -> None:
        """Begin a stage."""
        self._look()
        self.stage, self.units = stage, 0

    def advance(self, units: int) -> None:
        """So many more units are solved."""
        self._look()
        self.units += units

    @property
    def state(self) -> dict[str, Any]:
        """How far it has come, and its answer once there is one."""
        seconds = round(time.monotonic() - self.began, 1)
        told = {"kind": self.kind, "stage": self.stage, "units": self.units, "seconds": seconds}
        return {**told, "answer": self.answer, "error": self.error}

    def _look(self) -> None:
        if self._stop.is_set():
            raise _StoppedError

    def _run(self) -> None:
        try:
            answer = self.study.ask(self.kind, "quick", self)
            said = {"sentences": list(answer.told), "warnings": list(answer.warned)}
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
    from tolalloc.reports.charts import chart

    first = next(iter(answer.figures.values()), None)
    drawn = {"figure": chart(first)} if first else {}
    if answer.kind == "ranking":
        frame = answer.to_frame()
        return {**drawn, "shares": dict(zip(frame["source"], frame["contribution [%]"].astype(float), strict=True))}
    frame = answer.drawing_table
    zones = {str(row["source"]): float(row["zone [µm]"]) for _, row in frame.iterrows()}
    chosen = {name: float(answer.summary[name]) for name in settings if answer.summary.get(name) is not None}
    return {**drawn, "met": bool(answer.met), "cost": float(answer.cost), "zones": zones, "settings": chosen}
