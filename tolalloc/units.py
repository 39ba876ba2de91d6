"""Factors between the units that people write and the SI units used inside.

Multiply by the factor on the way in, divide on the way out: ``length = 4.0 * MICROMETRE``.
"""

from math import pi

MILLIMETRE = 1e-3
MICROMETRE = 1e-6
MICRORADIAN = 1e-6
DEGREE = pi / 180.0
ARCMINUTE = DEGREE / 60.0
ARCSECOND = DEGREE / 3600.0
RPM = 2 * pi / 60.0
MEGAPASCAL = 1e6
GIGAPASCAL = 1e9
