"""Make the project's environment if it is not there, then run a command in it.

    python3 .ci/with_environment.py tolalloc run studies/rv20e_allocation.py
    python3 .ci/with_environment.py pytest

Needs nothing but Python 3.11 or later; the environment is the folder .venv, or what TOLALLOC_ENVIRONMENT names.
"""

import hashlib
import os
import subprocess
import sys
import venv
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

ROOT = Path(__file__).resolve().parents[1]
CONSTRAINTS = ROOT / ".ci" / "constraints.txt"


def stop(sentence: str) -> NoReturn:
    print(f"Error: {sentence}", file=sys.stderr)
    sys.exit(2)


def environment() -> Path:
    """Return the folder of the environment's programs; what its stamps do not match is filled in.

    One stamp is that of the libraries, the other that of the package, which another clone may have put there.
    """
    folder = Path(os.environ.get("TOLALLOC_ENVIRONMENT") or ROOT / ".venv")  # empty is not the current folder
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    libraries = (folder / "libraries.stamp", hashlib.sha256(CONSTRAINTS.read_bytes()).hexdigest())
    own = hashlib.sha256((ROOT / "pyproject.toml").read_bytes()).hexdigest()
    package = (folder / "package.stamp", f"{own} {ROOT}")
    if not is_stamped(*libraries):
        fill(folder, python, ["--require-hashes", "-r", str(CONSTRAINTS)], *libraries)
    if not is_stamped(*package):
        fill(folder, python, ["--no-deps", "--no-build-isolation", "-e", str(ROOT)], *package)
    return python.parent


def is_stamped(stamp: Path, wanted: str) -> bool:
    return stamp.is_file() and stamp.read_text() == wanted


def fill(folder: Path, python: Path, what: list[str], stamp: Path, wanted: str) -> None:
    """Install something into the environment, made if it is not there, and stamp it."""
    own_pip = find_spec("ensurepip") is not None
    if not python.exists():
        make(folder, own_pip)
    # Debian may ship Python without ensurepip; its own pip can still fill the environment.
    pip = [str(python), "-m", "pip"] if own_pip else [sys.executable, "-m", "pip", "--python", str(python)]
    if not own_pip and find_spec("pip") is None:
        stop("this Python has neither ensurepip nor pip; on Debian or Ubuntu run: apt install python3-venv")
    if subprocess.run([*pip, "install", "--quiet", "--disable-pip-version-check", *what], check=False).returncode:
        stop(f"pip could not fill {folder}; its own message stands above.")
    stamp.write_text(wanted)


def make(folder: Path, own_pip: bool) -> None:
    """Make an empty environment."""
    print(f"Making the environment in {folder} (once, a minute or two) ...", file=sys.stderr, flush=True)
    try:
        venv.create(folder, with_pip=own_pip)
    except OSError as fault:
        stop(f"the environment {folder} cannot be made: {fault}. Remove it if another Python made it, and try again.")


def main() -> None:
    if sys.version_info < (3, 11):
        stop(f"Python 3.11 or later is needed, and this is {sys.version.split()[0]}.")
    if len(sys.argv) < 2:
        stop("a command is needed, for example: tolalloc run studies/rv20e_allocation.py")
    scripts = environment()
    path = os.pathsep.join([str(scripts), os.environ.get("PATH", "")])
    program = scripts / sys.argv[1]
    command = [str(program if program.exists() else sys.argv[1]), *sys.argv[2:]]
    sys.exit(subprocess.run(command, env={**os.environ, "PATH": path}, check=False).returncode)


if __name__ == "__main__":
    main()
