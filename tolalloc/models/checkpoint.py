"""Answers that are never asked for twice, in memory and in a checkpoint.

A search that draws its random numbers from the seed tree is a function of the answers it gets: one that is resumed
runs again from its first generation, reads what is known, and goes on with the same bits. Nothing in the file is ever
executed, and one from another version of a library can make a search slower but not wrong.
"""

from __future__ import annotations

import hashlib
import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation, Response

_PROBED = 1e-6
"""Relative difference up to which an answer asked for again is the same, on another machine too [-]."""

Designs = Float[np.ndarray, "design gene"]
Numbers = Float[np.ndarray, "design number"]


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """A file that keeps the answers of a search.

    Raises
    ------
    InputError
        The number is below 1, there is no folder to write to, or the file is no complete checkpoint of this question.
    """

    path: Path  # The file, new or written by the same search before
    every: int  # New answers after which it is written [-]
    question: str = ""  # Text that tells what is asked from everything else that has the same names and bounds

    def __post_init__(self) -> None:
        if self.every < 1:
            raise InputError.at("checkpoint", "every", self.every, "1 or more")
        if not self.path.absolute().parent.is_dir():
            raise InputError(f"{self.path}: there is no folder {self.path.absolute().parent} for the checkpoint.")
        if not os.access(self.path.absolute().parent, os.W_OK):
            raise InputError(f"{self.path}: the folder of the checkpoint cannot be written; name a file elsewhere.")
        if self.path.exists():  # found out now, and not when the search begins
            self.read()

    def read(self) -> tuple[str, Designs, Numbers]:
        """Return the identity of the problem, designs and their numbers; another file's are an InputError."""
        try:
            with np.load(self.path, allow_pickle=False) as file:
                identity, question, digest = (str(file[name]) for name in ("identity", "question", "digest"))
                designs, numbers = file["designs"], file["numbers"]
        except (OSError, EOFError, KeyError, ValueError, TypeError, AttributeError, zipfile.BadZipFile):
            raise InputError(
                f"{self.path}: this is no complete checkpoint, or it is truncated; allowed is a new file or one "
                "that the same search wrote."
            ) from None
        if digest != _digest(identity, designs, numbers):
            raise InputError(f"{self.path}: the checkpoint is damaged; remove it to start anew.")
        if question != _hashed(self.question):
            raise self.other_problem
        return identity, designs, numbers

    @property
    def other_problem(self) -> InputError:
        """What is said of a file that answers something else."""
        return InputError(f"{self.path}: the checkpoint is of another problem; remove it or name another file.")


class CachedAnswers:
    """Everything that has been answered so far.

    Parameters
    ----------
    ask
        Gives the numbers of designs that nobody has asked for yet, one row each.
    identity
        Text that tells this problem from others.
    checkpoint
        Where the answers are kept beyond this process; one of another problem is refused.
    """

    def __init__(self, ask: Callable[[Designs], Numbers], identity: str, checkpoint: Checkpoint | None = None) -> None:
        self._ask, self._checkpoint = ask, checkpoint
        self._identity = _hashed(identity)
        self._known: dict[bytes, Float[np.ndarray, " number"]] = {}
        self._unsaved = 0
        if checkpoint is not None and checkpoint.path.exists():
            self._read(checkpoint)

    def __call__(self, designs: Designs) -> Numbers:
        """Return the numbers of every design; only new ones are asked for, in pieces as the checkpoint wants them.

        A piece ends where the file is written, so a resumed search asks for designs in the same company as before.
        """
        keys = [design.tobytes() for design in designs]
        new = list({key: at for at, key in reversed(list(enumerate(keys))) if key not in self._known}.values())[::-1]
        size = self._checkpoint.every if self._checkpoint else len(new)
        for start in range(0, len(new), max(size, 1)):
            piece = new[start : start + size]
            for at, numbers in zip(piece, self._ask(designs[piece]), strict=True):
                self._known[keys[at]] = numbers
            self._unsaved += len(piece)
            if self._unsaved >= size:
                self.write()
        return np.array([self._known[key] for key in keys])

    def write(self) -> None:
        """Write all answers to the checkpoint, if there is one; a reader finds the old file or the new one, whole."""
        if self._checkpoint is None or not self._unsaved:
            return
        path = self._checkpoint.path
        designs, numbers = np.array([np.frombuffer(key) for key in self._known]), np.array([*self._known.values()])
        written = path.with_name(f"{path.name}.{os.getpid()}")
        try:
            with written.open("wb") as file:
                np.savez(
                    file,
                    identity=np.array(self._identity),
                    question=np.array(_hashed(self._checkpoint.question)),
                    designs=designs,
                    numbers=numbers,
                    digest=np.array(_digest(self._identity, designs, numbers)),
                )
            written.replace(path)
        finally:
            written.unlink(missing_ok=True)
        self._unsaved = 0

    def _read(self, checkpoint: Checkpoint) -> None:
        identity, designs, numbers = checkpoint.read()
        # Two problems may have the same names and bounds; what they answer tells them apart.
        if identity != self._identity or not np.allclose(
            self._ask(designs[:1]), numbers[:1], rtol=_PROBED, atol=0.0, equal_nan=True
        ):
            raise checkpoint.other_problem
        self._known = {design.tobytes(): row for design, row in zip(designs, numbers, strict=True)}


class CachedResponse:
    """A response that answers every sample once, beyond this process if there is a checkpoint."""

    def __init__(self, response: Response, checkpoint: Checkpoint | None = None) -> None:
        self.response = response
        self.answers = CachedAnswers(self._ask, repr((response.columns, response.outputs)), checkpoint)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.response.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs with their units."""
        return self.response.outputs

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the outputs of every sample."""
        numbers = self.answers(x)
        return Evaluation(values=numbers[:, :-1], status=numbers[:, -1].astype(np.uint8))

    def _ask(self, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample number"]:
        evaluation = self.response(x)
        return np.column_stack([evaluation.values, evaluation.status])


def _hashed(text: str) -> str:
    """Return the digest of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def _digest(identity: str, designs: Designs, numbers: Numbers) -> str:
    """Return the digest of all that a checkpoint holds."""
    return hashlib.sha256(identity.encode() + designs.tobytes() + numbers.tobytes()).hexdigest()
