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
    from tolalloc.allocation.cost.unit_price import QualityLoss as QualityLoss
    from tolalloc.allocation.cost.unit_price import UnitPrice as UnitPrice
    from tolalloc.allocation.space.effort import AllocationEffort as AllocationEffort
    from tolalloc.allocation.space.effort import FrontEffort as FrontEffort
    from tolalloc.allocation.space.effort import SearchEffort as SearchEffort
    from tolalloc.allocation.space.requirement import AtCpk as AtCpk
    from tolalloc.allocation.space.requirement import AtYield as AtYield
    from tolalloc.allocation.space.requirement import RootSumSquare as RootSumSquare
    from tolalloc.allocation.space.requirement import WorstCase as WorstCase
    from tolalloc.cli.main import run_script as run_script
    from tolalloc.cli.start import new as new
    from tolalloc.cli.start import schema as schema
    from tolalloc.drawings.compensators import Indexing as Indexing
    from tolalloc.drawings.compensators import Shim as Shim
    from tolalloc.drawings.drawing import Drawing as Drawing
    from tolalloc.drawings.drawing import load_drawing as drawing  # noqa: F401
    from tolalloc.drawings.seeds import SamplingDesign as SamplingDesign
    from tolalloc.drawings.seeds import SeedTree as SeedTree
    from tolalloc.drawings.sorting import Sorting as Sorting
    from tolalloc.exceptions import InputError as InputError
    from tolalloc.exceptions import RunFolderError as RunFolderError
    from tolalloc.exceptions import SolveError as SolveError
    from tolalloc.exceptions import TolallocError as TolallocError
    from tolalloc.exceptions import UnknownNameError as UnknownNameError
    from tolalloc.models.function_model import from_fmu as from_fmu
    from tolalloc.models.function_model import model as model
    from tolalloc.models.model import Evaluation as Evaluation
    from tolalloc.models.model import Model as Model
    from tolalloc.models.settings import Setting as Setting
    from tolalloc.reducers import BACKLASH as BACKLASH
    from tolalloc.reducers import DISC_TEMPERATURE as DISC_TEMPERATURE
    from tolalloc.reducers import EFFICIENCY as EFFICIENCY
    from tolalloc.reducers import FRICTION_TORQUE as FRICTION_TORQUE
    from tolalloc.reducers import HYSTERESIS_LOSS as HYSTERESIS_LOSS
    from tolalloc.reducers import LOST_MOTION as LOST_MOTION
    from tolalloc.reducers import LOST_MOTION_WITH_FRICTION as LOST_MOTION_WITH_FRICTION
    from tolalloc.reducers import PEAK_TO_PEAK as PEAK_TO_PEAK
    from tolalloc.reducers import PRELOAD as PRELOAD
    from tolalloc.reducers import RADIAL_CLEARANCE as RADIAL_CLEARANCE
    from tolalloc.reducers import TORSIONAL_STIFFNESS as TORSIONAL_STIFFNESS
    from tolalloc.reducers.choice import reducer as reducer
    from tolalloc.reducers.load_case import LoadCase as LoadCase
    from tolalloc.reducers.load_case import at as at
    from tolalloc.reducers.load_case import change as change
    from tolalloc.reducers.load_case import mean as mean
    from tolalloc.reducers.load_case import worst as worst
    from tolalloc.reports.document import Document as Document
    from tolalloc.reports.document import Section as Section
    from tolalloc.reports.figure import Figure as Figure
    from tolalloc.reports.figure import Series as Series
    from tolalloc.reports.portrait import Portrait as Portrait
    from tolalloc.reports.teller import Teller as Teller
    from tolalloc.sensitivity.effort import RankingEffort as RankingEffort
    from tolalloc.sensitivity.effort import SobolEffort as SobolEffort
    from tolalloc.study import numeric as numeric
    from tolalloc.study.answer import Answer as Answer
    from tolalloc.study.commands import check as check
    from tolalloc.study.commands import series as series
    from tolalloc.study.commands import whatif as whatif
    from tolalloc.study.problem import Effort as Effort
    from tolalloc.study.problem import Limit as Limit
    from tolalloc.study.questions import Allocation as Allocation
    from tolalloc.study.questions import Calculation as Calculation
    from tolalloc.study.questions import Difference as Difference
    from tolalloc.study.questions import Question as Question
    from tolalloc.study.questions import Ranking as Ranking
    from tolalloc.study.study import Study as Study

_WHERE = {
    "Allocation": "study.questions",
    "AllocationEffort": "allocation.space.effort",
    "Answer": "study.answer",
    "AtCpk": "allocation.space.requirement",
    "AtYield": "allocation.space.requirement",
    "BACKLASH": "reducers",
    "Calculation": "study.questions",
    "DISC_TEMPERATURE": "reducers",
    "Difference": "study.questions",
    "Document": "reports.document",
    "Drawing": "drawings.drawing",
    "EFFICIENCY": "reducers",
    "Effort": "study.problem",
    "Evaluation": "models.model",
    "FRICTION_TORQUE": "reducers",
    "Figure": "reports.figure",
    "FrontEffort": "allocation.space.effort",
    "HYSTERESIS_LOSS": "reducers",
    "InputError": "exceptions",
    "LOST_MOTION": "reducers",
    "LOST_MOTION_WITH_FRICTION": "reducers",
    "Limit": "study.problem",
    "Model": "models.model",
    "PEAK_TO_PEAK": "reducers",
    "PRELOAD": "reducers",
    "Portrait": "reports.portrait",
    "QualityLoss": "allocation.cost.unit_price",
    "Question": "study.questions",
    "RADIAL_CLEARANCE": "reducers",
    "Ranking": "study.questions",
    "RankingEffort": "sensitivity.effort",
    "RootSumSquare": "allocation.space.requirement",
    "RunFolderError": "exceptions",
    "SamplingDesign": "drawings.seeds",
    "SearchEffort": "allocation.space.effort",
    "Section": "reports.document",
    "SeedTree": "drawings.seeds",
    "Series": "reports.figure",
    "Setting": "models.settings",
    "Indexing": "drawings.compensators",
    "Shim": "drawings.compensators",
    "SobolEffort": "sensitivity.effort",
    "SolveError": "exceptions",
    "Sorting": "drawings.sorting",
    "Study": "study.study",
    "TORSIONAL_STIFFNESS": "reducers",
    "Teller": "reports.teller",
    "TolallocError": "exceptions",
    "UnitPrice": "allocation.cost.unit_price",
    "UnknownNameError": "exceptions",
    "WorstCase": "allocation.space.requirement",
    "LoadCase": "reducers.load_case",
    "at": "reducers.load_case",
    "change": "reducers.load_case",
    "mean": "reducers.load_case",
    "worst": "reducers.load_case",
    "check": "study.commands",
    "drawing": ("drawings.drawing", "load_drawing"),
    "from_fmu": "models.function_model",
    "model": ("models.function_model", "model"),
    "new": "cli.start",
    "numeric": ("study.numeric", ""),
    "reducer": "reducers.choice",
    "run_script": "cli.main",
    "schema": "cli.start",
    "series": "study.commands",
    "whatif": "study.commands",
}
"""Public name → where it stands, with its name there if that is another one, empty for a whole module."""

_INQUIRIES = (
    "assemble",
    "compare",
    "contact",
    "costs",
    "diagnose",
    "duty",
    "identify",
    "lot",
    "modify",
    "mount",
    "simulate",
    "te",
)
"""Questions that need no study, asked by a function of their own name and by the command of the same."""

__all__ = sorted([*_WHERE, *_INQUIRIES])


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("tolalloc")
    if name in _INQUIRIES:
        from tolalloc.study.inquiry import door

        return door(import_module(f"tolalloc.study.inquiries.{name}").INQUIRY)
    place = _WHERE.get(name)
    if place is None:
        raise AttributeError(f"module 'tolalloc' has no attribute {name!r}")
    module, own = place if isinstance(place, tuple) else (place, name)
    found = import_module(f"tolalloc.{module}")
    return getattr(found, own) if own else found


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
