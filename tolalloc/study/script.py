"""Reading the ``study`` of a Python script, with the modules and files that stand beside it."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from traceback import extract_tb
from types import ModuleType
from typing import TYPE_CHECKING

from tolalloc.exceptions import InputError, TolallocError

if TYPE_CHECKING:
    from tolalloc.study.study import Study


@dataclass(frozen=True, kw_only=True)
class StudyScript:
    """A study with the modules that stand beside its script, which no other study shall see."""

    study: Study
    folder: Path
    modules: dict[str, ModuleType]  # Those that were read from the folder

    @contextmanager
    def in_force(self) -> Iterator[None]:
        """Let imports find the modules of this study and none of another one."""
        with _modules_beside(self.folder, self.modules):
            yield


@contextmanager
def _modules_beside(folder: Path, modules: dict[str, ModuleType]) -> Iterator[None]:
    """Let imports look into a folder first; what they read from it is kept in the modules, and gone afterwards."""
    hidden = {
        name: module for name, module in list(sys.modules.items()) if name in modules or _belongs_to(name, folder)
    }
    for name in hidden:
        del sys.modules[name]
    sys.modules.update(modules)
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        modules.update({name: module for name, module in list(sys.modules.items()) if _belongs_to(name, folder)})
        for name in modules:
            sys.modules.pop(name, None)
        sys.modules.update(hidden)


def _belongs_to(name: str, folder: Path) -> bool:
    """Return whether the folder has the module of this name, wherever the one in memory was read."""
    from tolalloc.models.identity import is_users_module

    top = folder / name.partition(".")[0]
    return name != "__main__" and (top.with_suffix(".py").is_file() or top.is_dir()) and is_users_module(name)


def load_study(path: Path) -> Study:
    """Return the study of `load_script`, and leave its modules in force for the rest of the process."""
    script = load_script(path)
    sys.path.insert(0, str(script.folder))
    sys.modules.update(script.modules)
    return script.study


def load_script(path: Path) -> StudyScript:
    """Return the study that a script defines, without running its main part, and the modules that it reads.

    The script becomes a module of its own name, so that worker processes find its functions.

    Raises
    ------
    InputError
        The script is missing, broken, or defines no study.
    """
    import numpy as np

    from tolalloc.reading.file_content import is_file
    from tolalloc.study.study import Study

    if not is_file(path):
        raise InputError(f"{path}: no such study script.")
    folder, name = path.resolve().parent, path.stem
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: is no Python script; a study is a file that ends in .py.")
    module = importlib.util.module_from_spec(spec)
    modules = {name: module}
    try:
        # A script that tells NumPy to raise at a rounding would stop libraries that mean to go on.
        with _modules_beside(folder, modules), np.errstate():
            spec.loader.exec_module(module)
    except TolallocError as error:
        raise InputError(f"{path}: {error}") from None
    except SystemExit:
        raise InputError(f"{path}: the script ends the program when it is read; put that under __main__.") from None
    except Exception as error:
        raise InputError(_broken(path, error)) from None
    study = getattr(module, "study", None)
    if not isinstance(study, Study):
        raise InputError(f"{path}: study is {type(study).__name__}; a script must define study = Study(...).")
    return StudyScript(study=study, folder=folder, modules=modules)


def _broken(path: Path, error: Exception) -> str:
    """Return why a script cannot be read, with its line where it is known."""
    reason = " ".join(str(error).split())
    lines = [own.lineno for own in extract_tb(error.__traceback__) if own.filename == str(path)]
    place = f"{path}, line {lines[-1]}" if lines else f"{path}"
    hint = "; is it truncated?" if isinstance(error, SyntaxError) else "."
    return f"{place}: the script cannot be read as a study ({type(error).__name__}: {reason}){hint}"
