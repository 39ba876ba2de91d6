"""Reading the ``study`` of a Python script, with the modules and files that stand beside it."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tolalloc.exceptions import InputError, TolallocError

if TYPE_CHECKING:
    from tolalloc.study.study import Study


def load_study(path: Path) -> Study:
    """Return the study that a script defines, without running its main part.

    The script becomes a module of its own name, so that worker processes find its functions.

    Raises
    ------
    InputError
        The script is missing, broken, or defines no study.
    """
    from tolalloc.file_content import is_file
    from tolalloc.files import relative_to
    from tolalloc.study.study import Study

    if not is_file(path):
        raise InputError(f"{path}: no such study script.")
    folder, name = path.resolve().parent, path.stem
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: is no Python script; a study is a file that ends in .py.")
    module = importlib.util.module_from_spec(spec)
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    sys.modules[name] = module
    try:
        with relative_to(folder):
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
    return study


def _broken(path: Path, error: Exception) -> str:
    """Return why a script cannot be read, with its line where it is known."""
    reason = " ".join(str(error).split())
    trace, line = error.__traceback__, 0
    while trace:
        if trace.tb_frame.f_code.co_filename == str(path):
            line = trace.tb_lineno
        trace = trace.tb_next
    place = f"{path}, line {line}" if line else f"{path}"
    hint = "; is it truncated?" if isinstance(error, SyntaxError) else "."
    return f"{place}: the script cannot be read as a study ({type(error).__name__}: {reason}){hint}"
