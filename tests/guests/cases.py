"""Studies as other offices would write them, each with what is known of its answers by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import hypot, pi, radians, sin, sqrt, tan
from pathlib import Path

import tolalloc as ta

STUDIES = Path(__file__).parent / "studies"
REDUCER_UNITS, UNITS = 512, 20_000
"""Random units of a guest whose mean and standard deviation are compared with those by hand [-]."""


@dataclass(frozen=True)
class Hand:
    """Mean and standard deviation of an output of the drawing as it is, worked out by hand [unit of the output]."""

    mean: float
    sigma: float
    within: float = 0.0  # Part of the standard deviation by which linearising may move either [-]


@dataclass(frozen=True, kw_only=True)
class Guest:
    """A study in a folder of its name.

    Parameters
    ----------
    name
        Folder below ``studies``.
    cost
        Of the zones of its table: all costs, each as often as its row stands for places [cost units].
    hand
        Output → mean and standard deviation.
    order
        Dimensions of the drawing by their part in the variance of the leading output, the largest first.
    zones
        Another zone for `whatif`: source, or a row for several, → zone [µm].
    reducer
        Whether it asks a reducer, which takes seconds.
    """

    name: str
    cost: float
    hand: Mapping[str, Hand] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    zones: Mapping[str, float]
    reducer: bool = False

    @property
    def script(self) -> Path:
        """The script of the study."""
        return STUDIES / self.name / "study.py"


def _six(*zones: float) -> float:
    """Return σ of a sum of normal parts that fill their zones with six σ, 99.73 % of them inside."""
    return hypot(*zones) / 6


_SORTED = 0.12 / (6 * 0.5) * sqrt(1 - 3 * 0.1295176 / 0.8663856)
"""Of Cp 0.5 the zone of 0.12 mm is ±1.5σ; a normal law cut there has the variance 1 − 2·1.5·φ(1.5)/(2Φ(1.5) − 1)."""
_ANGLE = (55.29 + 22.86) / (101.69 - 22.86)
"""Cosine of the contact angle; its derivatives are 1, 1 + cos and −cos over cage − roller."""
_PINS = [-5, -3, -2, -1, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 9, 10, 11, 13]
"""The measured pins [µm]: Σ = 96, Σ² = 854 of 25, so that the mean is 3.84 and s² = (854 − 25·3.84²)/24 = 20.22."""

STACKS = (
    Guest(
        name="bearing_seat",
        cost=8,
        # 50 − (15 − 0.06) − 33 − 1.5; the bearing's zone is 0.12
        hand={"play [mm]": Hand(0.56, _six(0.2, 0.12, 0.2, 0.1))},
        zones={"ring": 50},
    ),
    Guest(
        name="one_way_clutch",
        cost=15,
        # σ of each size is 0.01 mm; dθ = −d(cos θ)/sin θ, in degrees
        hand={
            "contact angle [deg]": Hand(
                7.53049,
                0.01 * hypot(1, 1 + _ANGLE, _ANGLE) / (101.69 - 22.86) / sqrt(1 - _ANGLE**2) * 180 / pi,
                within=0.02,
            )
        },
        order=("roller", "hub", "cage"),
        zones={"roller": 40},
    ),
    Guest(
        name="shim_stack_inches",
        cost=12,
        hand={"shim [in]": Hand(3.25 - 0.5 - 1.46 - 1.25, _six(0.006, 0.004, 0.004, 0.004))},
        order=("bore",),
        zones={"bore": 101.6},  # 0.004 in
    ),
    Guest(
        name="fit_h7_h6",
        cost=10,
        # ISO 286 at 25 mm: H7 is 0/+21, h6 is 0/−13; middles 10.5 and −6.5
        hand={"clearance [µm]": Hand(17, _six(21, 13))},
        order=("bore", "shaft"),
        zones={"bore": 13},
    ),
    Guest(
        name="spacers_4x",
        cost=7,
        # a uniform zone w has σ = w/√12
        hand={"length [mm]": Hand(52, hypot(0.12 / 6, sqrt(4) * 0.1 / sqrt(12)))},
        order=("4x spacer*", "plate"),
        zones={"4x spacer*": 60},
    ),
    Guest(
        name="shifted_process",
        cost=2,
        # Cp 1.5: σ = 0.12/9, its mean half of half the zone off; the other one cut at ±1.5σ
        hand={"step [mm]": Hand(0.5 * 0.06, hypot(0.12 / 9, _SORTED))},
        order=("ground", "turned"),
        zones={"ground": 60},
    ),
    Guest(
        name="three_shapes",
        cost=3,
        # half zone h = 0.09: triangle h/√6, trapezoid of plateau h/2 √((h² + h²/4)/6), uniform h/√3
        hand={"sum [mm]": Hand(21, 0.09 * sqrt(1 / 6 + 1.25 / 6 + 1 / 3))},
        order=("c", "b", "a"),
        zones={"c": 90},
    ),
    Guest(
        name="like_lots",
        cost=3,
        # var = σ²(1 + 1 + 1 + 2·0.6) with σ = 10 µm; the correlation of the sleeves adds
        hand={"gap [mm]": Hand(6, 0.01 * sqrt(4.2))},
        order=("left + right", "pipe"),
        zones={"pipe": 30},
    ),
    Guest(
        name="measured_pins",
        cost=4,
        hand={"height [mm]": Hand(15 + 3.84e-3, 1e-3 * hypot(sqrt((854 - 25 * 3.84**2) / 24), 40 / 6))},
        order=("plate", "pin"),
        zones={"plate": 20},
    ),
    Guest(
        name="shop_prices",
        # A + B/t of the way that reaches ±t = 0.04 mm: ground 1.5 + 0.02/0.04 for a and b, milled 0.2 + 0.08/0.04 for c
        cost=2 * 2 + 2.2,
        hand={"gap [mm]": Hand(40 - 30 - 9.5, 0.08 / 6 * hypot(1, 1, 0.5))},
        zones={"a": 60},
    ),
    Guest(
        name="hole_pattern",
        cost=8,
        # 99.73 % of the axes within a radius of 0.05: σ on each axis is 0.05/√(−2 ln 0.0027); x alone counts
        hand={"distance [mm]": Hand(80, sqrt(2) * 0.05 / 3.439350)},
        zones={"left": 50},
    ),
)

TABLES = (
    Guest(
        name="buero_csv",
        cost=4.5 + 3.2 + 0.75,
        hand={"Spiel [mm]": Hand(40 - 38.16 - 1.5, _six(0.1, 0.08, 0.08))},
        order=("M1",),
        zones={"M3": 40},
    ),
    Guest(
        name="buero_xlsx",
        cost=8 + 2 * 2 + 3,
        # 8 h6 is 0/−9 µm, so that each pin is 4.5 µm small in the mean and counts half
        hand={"Überstand [mm]": Hand(30 - 7.9955 - 20, _six(0.1, 0.0045, 0.0045, 0.12))},
        order=("Buchse", "Platte", "Bolzen"),
        zones={"Bolzen": 5},
    ),
    Guest(
        name="bureau_csv",
        cost=9.5,
        hand={"jeu [mm]": Hand(0.3, hypot(0.16 / 6, 0.12 / sqrt(12)))},
        order=("arbre", "carter"),
        zones={"arbre": 60},
    ),
    Guest(
        name="gongsi_csv",
        cost=60,
        hand={"间隙 [mm]": Hand(0.5, _six(0.24, 0.18, 0.1))},
        order=("箱体", "轴", "垫片"),
        zones={"垫片": 50},
    ),
    Guest(
        name="office_english",
        cost=7,
        hand={"clearance [mm]": Hand(0.0195 + 0.0375, _six(0.039, 0.025))},
        order=("hole", "shaft"),
        zones={"hole": 25},
    ),
)

_TWO = _six(0.1, 0.1)
_BALL = 10 / (2 * sin(0.5))
FUNCTIONS = (
    Guest(
        name="whole_columns",
        cost=2,
        hand={"gap [mm]": Hand(0.1, _TWO)},
        zones={"slot": 50},
    ),
    Guest(name="compiled", cost=2, hand={"middle [mm]": Hand(20, _TWO / 2)}, zones={"left": 50}),
    Guest(name="called_object", cost=2, hand={"stroke [mm]": Hand(0.3, 3 * _TWO)}, zones={"pin": 50}),
    Guest(
        name="bound_partly",
        cost=2,
        # dr = 100·(1/50)·da − 100·(25/50²)·db
        hand={"ratio [%]": Hand(50, _six(0.1 * 2, 0.1 * 1), within=0.01)},
        order=("first", "second"),
        zones={"first": 50},
    ),
    Guest(
        name="by_place_alone",
        cost=3,
        # the frame's zone is 0.13 with its middle at 0.015
        hand={"gap [mm]": Hand(60.015 - 58 - 1.8, _six(0.13, 0.1, 0.1))},
        order=("frame",),
        zones={"frame": 65},
    ),
    Guest(
        name="named_outputs",
        cost=3,
        hand={"seat [mm]": Hand(0.08, _TWO), "key play [mm]": Hand(0.05, 0.1 / 6)},
        zones={"key": 50},
    ),
    Guest(name="with_setting", cost=2, hand={"preload [mm]": Hand(0.1, _TWO)}, zones={"pack": 50}),
    Guest(
        name="root_of_an_equation",
        cost=4,
        # h = d/(2 sin α), ∂h/∂d = 1/(2 sin α), ∂h/∂α = −h/tan α, and α moves by 0.01 rad per mm
        hand={"height [mm]": Hand(_BALL, _six(0.04 / (2 * sin(0.5)), 0.006 * _BALL / tan(0.5)), within=0.01)},
        order=("width", "ball"),
        zones={"width": 300},
    ),
)

_PRESSED = 0.12 * 206e3 / (30 * 8 / 3) * pi * 30**2 * 25 / 2 / 1000
"""Torque of a press fit per mm of interference: that over the diameter is the pressure over the modulus times
(60² + 30²)/(60² − 30²) + 1 = 8/3, of a hub of 60 on a shaft of 30."""
_FLANK = 17 * 0.14 / (2 * sin(radians(60)))
TORQUES = (
    Guest(
        name="press_fit_torque",
        cost=12,
        # the shaft's middle is 41.5 µm, that of 30 H6 (0/+13) 6.5 µm: 35 µm of interference
        hand={"torque [N·m]": Hand(0.035 * _PRESSED, _PRESSED * _six(0.013, 0.013))},
        zones={"bore": 8},
    ),
    Guest(
        name="screw_torque",
        cost=0.4,
        # flank diameter 7.188 − 0.059; a millimetre of it is 1.374 N·m, one of the head 1.19
        hand={
            "torque [N·m]": Hand(
                17 * 1.25 / (2 * pi) + _FLANK * 7.129 + 17 * 0.07 * 10.7, _six(0.118 * _FLANK, 0.4 * 17 * 0.07)
            )
        },
        order=("head", "flank"),
        zones={"head": 200},
    ),
)

_CLEARANCE = ta.RADIAL_CLEARANCE
# A pin bears on the bottom of its groove: the radial clearance is that of the modification, less the pin's larger
# diameter, and with the groove's larger radius.
REDUCERS = (
    Guest(
        name="joint_rv20e",
        cost=14,
        hand={_CLEARANCE: Hand(8 + 3, hypot(1, 1))},
        zones={"pin.diameter": 4},
        reducer=True,
    ),
    Guest(name="loaded_rv20e", cost=6 * 4, zones={"4x crank*.journal*.eccentricity": 4}, reducer=True),
    Guest(
        name="cobot_cd29",
        cost=3,
        hand={_CLEARANCE: Hand(8, 5 / 6)},
        zones={"pin.diameter": 6},
        reducer=True,
    ),
    Guest(
        name="hollow_rv27c",
        cost=6,
        hand={_CLEARANCE: Hand(8.8, hypot(1, 1))},
        zones={"pin.diameter": 4},
        reducer=True,
    ),
    Guest(
        name="office_rv80e",
        cost=10 + 6 * 6.5 + 6 * 5 + 8,
        # 8 h5 is 0/−6 µm, its middle 3 µm small
        hand={_CLEARANCE: Hand(10 + 3, hypot(1, 0.5))},
        zones={"Exzenter": 4},
        reducer=True,
    ),
)

GUESTS = (*STACKS, *TABLES, *FUNCTIONS, *TORQUES, *REDUCERS)
