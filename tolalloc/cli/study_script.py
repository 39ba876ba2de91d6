"""Reading the ``study`` of a Python script without running its main part."""

from __future__ import annotations

import runpy
from pathlib import Path

from tolalloc.exceptions import InputError, TolallocError
from tolalloc.study.definition import Study


def load_study(path: Path) -> Study:
    """Return the study that a script defines.

    Raises
    ------
    InputError
        The script is missing, broken, or defines no study.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such study script.")
    try:
        names = runpy.run_path(str(path), run_name="study")
    except TolallocError as error:
        raise InputError(f"{path}: {error}") from None
    except Exception as error:
        reason = " ".join(str(error).split())
        hint = "; is it truncated?" if isinstance(error, SyntaxError) else "."
        raise InputError(
            f"{path}: the script cannot be read as a study ({type(error).__name__}: {reason}){hint}"
        ) from None
    study = names.get("study")
    if not isinstance(study, Study):
        raise InputError(f"{path}: study is {type(study).__name__}; a script must define study = Study(...).")
    return study
