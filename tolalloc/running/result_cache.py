"""Solved units kept in files, so that a run that was stopped goes on where it was and ends in the same bits.

One file holds the answer of one chunk. It is named after a digest of all that the answer follows from: this package's
code, the libraries and the processor, what solves the chunk (model, torque, outputs), and the chunk itself. So a file
is right for whoever asks the same, in whatever study, and a file of another version is never found.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import json
import os
import pickle
import tempfile
import time
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.running.chunks import Mapper

_WORTH = 0.05
"""Time that a chunk takes from which its answer is kept [s]."""
_LARGEST_ANSWER = 2**26
"""Size up to which an answer is kept [bytes]."""
_OWN = ("tolalloc", "numpy", "builtins", "functools", "collections", "pathlib", "enum")
"""Packages whose functions and classes a version of this package fixes; a user's own may change under their name."""
_ENDING = ".units"


class _NotKeptError(Exception):
    """What solves a chunk, or its answer, is nothing that a file can hold."""


@dataclass(frozen=True, kw_only=True)
class ResultCache:
    """A mapper, as `tolalloc.running.chunks.map_chunks` takes it, that solves only chunks that no file answers."""

    folder: Path  # Where the files are; made when the first is written. Several runs may share it
    largest: int = 2 * 2**30  # Size of all files above which the oldest are taken away before a run [bytes]
    solved_by: Mapper = map  # Mapper that solves the other chunks: this process, or workers

    def __call__(
        self,
        solve: Callable[[Float[np.ndarray, "chunk column"]], Any],
        chunks: Iterable[Float[np.ndarray, "chunk column"]],
    ) -> Iterator[Any]:
        """Yield the answers in the order of the chunks."""
        found = [
            (chunk, digest, self._known(digest)) for chunk, digest in ((own, _digest(solve, own)) for own in chunks)
        ]
        answers = iter(self.solved_by(solve, (chunk for chunk, _, known in found if known is None)))
        for _, digest, known in found:
            if known is not None:
                yield known[0]
                continue
            start = time.perf_counter()
            answer = next(answers)
            # What workers solved may have lain ready, however long it took them.
            if digest and (self.solved_by is not map or time.perf_counter() - start >= _WORTH):
                self._keep(answer, digest)
            yield answer

    def _known(self, digest: str) -> tuple[Any] | None:
        """Return the answer that a file has to a chunk, if there is one."""
        return _read(self.folder / f"{digest}{_ENDING}", digest) if digest else None

    def pruned(self) -> ResultCache:
        """Take the oldest files away until the rest is small enough, and return the same."""
        files = list[tuple[float, int, Path]]()
        for path in self.folder.glob(f"*{_ENDING}"):
            with suppress(FileNotFoundError):  # another run may take it away at this moment
                about = path.stat()
                files.append((about.st_mtime, about.st_size, path))
        size = 0
        for _, own, path in sorted(files, reverse=True):
            size += own
            if size > self.largest:
                path.unlink(missing_ok=True)
        return self

    def _keep(self, answer: Any, digest: str) -> None:
        """Write an answer under another name first, so that no file is ever half an answer."""
        arrays: list[np.ndarray] = []
        try:
            form = _form(answer, arrays)
        except _NotKeptError:
            return
        if sum(array.nbytes for array in arrays) > _LARGEST_ANSWER:
            return
        content = io.BytesIO()
        named: dict[str, Any] = {f"array{number}": array for number, array in enumerate(arrays)}
        np.savez(content, digest=np.array(digest), form=np.array(json.dumps(form)), **named)
        self.folder.mkdir(parents=True, exist_ok=True)
        handle, beside = tempfile.mkstemp(dir=self.folder, suffix=".unfinished")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content.getvalue())
            Path(beside).replace(self.folder / f"{digest}{_ENDING}")
        finally:
            Path(beside).unlink(missing_ok=True)


@cache
def code_digest() -> str:
    """Return what tells this package's code, with the libraries that compute, from every other version."""
    package = Path(__file__).parents[1]
    code = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(package.glob("**/*.py")))).hexdigest()
    return "\n".join([code, *(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))])


@cache
def _machine() -> bytes:
    """Return what answers follow from beside the question: code, libraries and kind of processor."""
    from tolalloc.running.compiled import processor

    return "\n".join([code_digest(), *processor().values()]).encode()


class _Pickler(pickle.Pickler):
    """Writes what belongs to this package or to libraries of a known version, and refuses the rest."""

    def reducer_override(self, value: Any) -> Any:
        """Refuse functions and classes from elsewhere."""
        if isinstance(value, type | FunctionType) and value.__module__.partition(".")[0] not in _OWN:
            raise _NotKeptError
        return NotImplemented


def _digest(solve: Callable[..., Any], chunk: Float[np.ndarray, "chunk column"]) -> str:
    """Return the digest of a chunk's answer; empty where what solves it cannot be told from others."""
    content = io.BytesIO()
    try:
        _Pickler(content, protocol=5).dump(solve)
    except (_NotKeptError, pickle.PicklingError, AttributeError, TypeError):
        return ""
    found = hashlib.sha256(_machine())
    found.update(content.getvalue())
    found.update(f"{chunk.shape}{chunk.dtype}".encode())
    found.update(np.ascontiguousarray(chunk).tobytes())
    return found.hexdigest()


def _form(value: Any, arrays: list[np.ndarray]) -> Any:
    """Return the structure of an answer, its arrays put aside."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, tuple) and type(value) is tuple:
        return {"tuple": [_form(part, arrays) for part in value]}
    if isinstance(value, dict):
        return {"dict": {name: _form(part, arrays) for name, part in value.items()}}
    if is_dataclass(value) and not isinstance(value, type) and type(value).__module__.startswith("tolalloc."):
        parts = {field.name: _form(getattr(value, field.name), arrays) for field in fields(value)}
        return {"record": [type(value).__module__, type(value).__qualname__], "fields": parts}
    raise _NotKeptError


def _read(path: Path, digest: str) -> tuple[Any] | None:
    """Return the answer in a file; none if there is no such file, or it is damaged or another's."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            if str(stored["digest"]) != digest:
                return None
            found = _built(json.loads(str(stored["form"])), stored)
        path.touch()
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile, zlib.error):
        return None
    return (found,)


def _built(form: Any, stored: Any) -> Any:
    """Return the answer of a structure and its arrays; only records of this package are made."""
    ((kind, content), *_) = form.items()
    if kind == "array":
        return stored[f"array{content}"]
    if kind == "tuple":
        return tuple(_built(part, stored) for part in content)
    if kind == "dict":
        return {name: _built(part, stored) for name, part in content.items()}
    module, name = content
    if not module.startswith("tolalloc."):
        raise ValueError(f"{module} is no module of this package")
    record = getattr(importlib.import_module(module), name)
    return record(**{field: _built(part, stored) for field, part in form["fields"].items()})
