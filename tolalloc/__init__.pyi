"""Public names and where they stand, which the package itself reads; questions without a study come by their words."""

from typing import Any

from tolalloc import numeric as numeric
from tolalloc.allocation.cost.unit_price import QualityLoss as QualityLoss
from tolalloc.allocation.cost.unit_price import UnitPrice as UnitPrice
from tolalloc.allocation.space.effort import AllocationEffort as AllocationEffort
from tolalloc.allocation.space.effort import SearchEffort as SearchEffort
from tolalloc.allocation.space.requirement import AtCpk as AtCpk
from tolalloc.allocation.space.requirement import AtYield as AtYield
from tolalloc.allocation.space.requirement import RootSumSquare as RootSumSquare
from tolalloc.allocation.space.requirement import WorstCase as WorstCase
from tolalloc.capability.gauge_choice import Gauge as Gauge
from tolalloc.capability.gauge_choice import costs_of_gauges as costs_of_gauges
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
from tolalloc.models.model import installed_model as installed_model
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

__version__: str

def __getattr__(name: str) -> Any: ...
