"""Functional Mock-up Units, simulated by FMPy: an optional extra (``pip install -e '.[fmu]'``)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tolalloc.exceptions import InputError


@dataclass(frozen=True)
class SimulatedUnit:
    """A unit as a function of its parameters, one sample a call.

    Parameters
    ----------
    path
        The file.
    parameters, variables
        What is set before, and read after a simulation.
    stop_time
        Simulated time [s].
    engine
        The library.
    """

    path: Path
    parameters: tuple[str, ...]
    variables: tuple[str, ...]
    stop_time: float
    engine: Any

    @property
    def name(self) -> str:
        """The file's name."""
        return self.path.stem

    def __call__(self, *values: float) -> list[float]:
        """Return the variables at the end of a simulation with these parameters.

        Raises
        ------
        ValueError
            The simulation has no end.
        """
        start = {name: float(value) for name, value in zip(self.parameters, values, strict=True)}
        try:
            found = self.engine.simulate_fmu(
                str(self.path), start_values=start, output=list(self.variables), stop_time=self.stop_time
            )
        except TypeError:
            raise
        except Exception as error:
            raise ValueError(f"{self.path}: {error}") from None
        return [float(found[name][-1]) for name in self.variables]


def simulated(path: str, parameters: tuple[str, ...], variables: tuple[str, ...], stop_time: float) -> SimulatedUnit:
    """Return a unit as a function.

    Raises
    ------
    InputError
        The library is missing, or there is no such file.
    """
    try:
        import fmpy
    except ImportError:
        raise InputError("Functional Mock-up Units need the optional extra: pip install -e '.[fmu]'.") from None
    if not Path(path).is_file():
        raise InputError(f"{path}: no such Functional Mock-up Unit.")
    return SimulatedUnit(Path(path), parameters, variables, stop_time, fmpy)
