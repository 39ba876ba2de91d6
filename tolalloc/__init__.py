"""Which drawing tolerance drives an output, and which tolerances and settings meet a limit at the lowest cost.

>>> import tolalloc as ta
>>> ta.reducer("rv20e").name
'RV-20E'

Names are loaded when they are first used, so that importing the package takes a fraction of a second.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolalloc.allocation.classical_guarantee import RootSumSquare as RootSumSquare
    from tolalloc.allocation.classical_guarantee import WorstCase as WorstCase
    from tolalloc.allocation.cost.unit_price import QualityLoss as QualityLoss
    from tolalloc.allocation.cost.unit_price import UnitPrice as UnitPrice
    from tolalloc.allocation.effort import AllocationEffort as AllocationEffort
    from tolalloc.allocation.effort import FrontEffort as FrontEffort
    from tolalloc.allocation.effort import SearchEffort as SearchEffort
    from tolalloc.allocation.guarantee import AtCpk as AtCpk
    from tolalloc.allocation.guarantee import AtYield as AtYield
    from tolalloc.cli.main import run_script as run_script
    from tolalloc.drawings.drawing import Drawing as Drawing
    from tolalloc.drawings.drawing import load_drawing as drawing  # noqa: F401
    from tolalloc.drawings.seeds import SamplingDesign as SamplingDesign
    from tolalloc.drawings.seeds import SeedTree as SeedTree
    from tolalloc.exceptions import InputError as InputError
    from tolalloc.exceptions import RunFolderError as RunFolderError
    from tolalloc.exceptions import SolveError as SolveError
    from tolalloc.exceptions import TolallocError as TolallocError
    from tolalloc.exceptions import UnknownNameError as UnknownNameError
    from tolalloc.function_model import from_fmu as from_fmu
    from tolalloc.function_model import model as model
    from tolalloc.models import Evaluation as Evaluation
    from tolalloc.models import Model as Model
    from tolalloc.report.answer import Answer as Answer
    from tolalloc.report.document import Document as Document
    from tolalloc.report.document import Section as Section
    from tolalloc.report.figure import Figure as Figure
    from tolalloc.report.figure import Series as Series
    from tolalloc.rv import BACKLASH as BACKLASH
    from tolalloc.rv import EFFICIENCY as EFFICIENCY
    from tolalloc.rv import FRICTION_TORQUE as FRICTION_TORQUE
    from tolalloc.rv import HYSTERESIS_LOSS as HYSTERESIS_LOSS
    from tolalloc.rv import LOST_MOTION as LOST_MOTION
    from tolalloc.rv import LOST_MOTION_WITH_FRICTION as LOST_MOTION_WITH_FRICTION
    from tolalloc.rv import PEAK_TO_PEAK as PEAK_TO_PEAK
    from tolalloc.rv import PRELOAD as PRELOAD
    from tolalloc.rv import RADIAL_CLEARANCE as RADIAL_CLEARANCE
    from tolalloc.rv import TORSIONAL_STIFFNESS as TORSIONAL_STIFFNESS
    from tolalloc.rv.choice import reducer as reducer
    from tolalloc.sensitivity.effort import RankingEffort as RankingEffort
    from tolalloc.sensitivity.effort import SobolEffort as SobolEffort
    from tolalloc.settings import Setting as Setting
    from tolalloc.study.effort import Effort as Effort
    from tolalloc.study.limit import Limit as Limit
    from tolalloc.study.questions import Allocation as Allocation
    from tolalloc.study.questions import Calculation as Calculation
    from tolalloc.study.questions import Difference as Difference
    from tolalloc.study.questions import Question as Question
    from tolalloc.study.questions import Ranking as Ranking
    from tolalloc.study.study import Study as Study

_WHERE = {
    "Allocation": "study.questions",
    "AllocationEffort": "allocation.effort",
    "Answer": "report.answer",
    "AtCpk": "allocation.guarantee",
    "AtYield": "allocation.guarantee",
    "BACKLASH": "rv",
    "Calculation": "study.questions",
    "Difference": "study.questions",
    "Document": "report.document",
    "Drawing": "drawings.drawing",
    "EFFICIENCY": "rv",
    "Effort": "study.effort",
    "Evaluation": "models",
    "FRICTION_TORQUE": "rv",
    "Figure": "report.figure",
    "FrontEffort": "allocation.effort",
    "HYSTERESIS_LOSS": "rv",
    "InputError": "exceptions",
    "LOST_MOTION": "rv",
    "LOST_MOTION_WITH_FRICTION": "rv",
    "Limit": "study.limit",
    "Model": "models",
    "PEAK_TO_PEAK": "rv",
    "PRELOAD": "rv",
    "QualityLoss": "allocation.cost.unit_price",
    "Question": "study.questions",
    "RADIAL_CLEARANCE": "rv",
    "Ranking": "study.questions",
    "RankingEffort": "sensitivity.effort",
    "RootSumSquare": "allocation.classical_guarantee",
    "RunFolderError": "exceptions",
    "SamplingDesign": "drawings.seeds",
    "SearchEffort": "allocation.effort",
    "Section": "report.document",
    "SeedTree": "drawings.seeds",
    "Series": "report.figure",
    "Setting": "settings",
    "SobolEffort": "sensitivity.effort",
    "SolveError": "exceptions",
    "Study": "study.study",
    "TORSIONAL_STIFFNESS": "rv",
    "TolallocError": "exceptions",
    "UnitPrice": "allocation.cost.unit_price",
    "UnknownNameError": "exceptions",
    "WorstCase": "allocation.classical_guarantee",
    "drawing": ("drawings.drawing", "load_drawing"),
    "from_fmu": "function_model",
    "model": ("function_model", "model"),
    "reducer": "rv.choice",
    "run_script": "cli.main",
}
"""Public name → where it stands, with its name there if that is another one."""

__all__ = sorted(_WHERE)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("tolalloc")
    place = _WHERE.get(name)
    if place is None:
        raise AttributeError(f"module 'tolalloc' has no attribute {name!r}")
    module, own = place if isinstance(place, tuple) else (place, name)
    return getattr(import_module(f"tolalloc.{module}"), own)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
