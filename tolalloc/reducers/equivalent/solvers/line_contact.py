"""Force and stiffness of line contacts, eight side by side.

No table and no iteration that ends by itself, so that a lane has the same bits alone and among others.
"""

from __future__ import annotations

from tolalloc.reducers.equivalent.solvers.lanes import (
    above,
    add,
    choose,
    divide,
    fma,
    larger,
    logarithm,
    multiply,
    spread,
    subtract,
)
from tolalloc.running.compiled import jit_within

DEEPEST = 2.5
"""ln(λ/depth) of the deepest line contact that is solved here; no pin is pressed nearly so far [-]."""
_FITTED = (5.0, 40.0)
"""The same, between which w is a quotient of two polynomials; contacts elsewhere hardly touch, or bend [-]."""
# Polynomials in ln(λ/depth) whose quotient is w within 3e-15 of it; the highest power first
_ABOVE = (
    5.672391747372849e-07,
    0.0001299594283366941,
    0.007869168757409338,
    0.16762474883751757,
    1.3152282419323045,
    3.208371600720944,
    -0.0405589794698379,
    -2.926977775381174,
    0.22754703860728592,
)
_BELOW = (
    1e-12,
    5.660080962424214e-07,
    0.00012637603146998638,
    0.007277723649627696,
    0.1416246660138495,
    0.9440256812267587,
    1.6378491713093841,
    -0.5558535883401736,
    -0.62195314420652,
)


@jit_within
def _polynomial(coefficients, x):
    """Return a polynomial by its coefficients, the highest power first."""
    total = spread(coefficients[0])
    for i in range(1, len(coefficients)):
        total = fma(total, x, spread(coefficients[i]))
    return total


@jit_within
def _halley(w, goal):
    """Return w after one of Halley's steps to w − ln w = goal."""
    one = spread(1.0)
    inverse = divide(one, multiply(w, subtract(w, one)))
    newton = multiply(multiply(subtract(subtract(w, logarithm(w)), goal), multiply(w, w)), inverse)
    return subtract(w, multiply(newton, fma(multiply(spread(0.5), newton), inverse, one)))


@jit_within
def line_contact(stiffness, log_length, depth):
    """Return force, stiffness and one bit per lane that is pressed too far, of Hertzian line contact at depths above 0.

    The law of `tolalloc.reducers.cycloid.solvers.contact_law`: w − ln w = ln(λ/depth), F = c·depth/w with c twice the
    stiffness k, and dF/d(depth) = c/(w − 1). Quotients share their denominators: a division takes as long as ten
    products.
    """
    one = spread(1.0)
    goal = subtract(log_length, logarithm(depth))
    far = above(spread(DEEPEST), goal)
    goal = larger(goal, spread(DEEPEST))
    p, q = _polynomial(_ABOVE, goal), _polynomial(_BELOW, goal)  # w = p/q
    elsewhere = above(goal, spread(_FITTED[1])) | above(spread(_FITTED[0]), goal)
    if elsewhere:
        w = _halley(_halley(_halley(add(goal, logarithm(add(goal, one))), goal), goal), goal)
        p, q = choose(elsewhere, w, p), choose(elsewhere, one, q)
    below = subtract(p, q)
    scale = divide(multiply(add(stiffness, stiffness), q), multiply(p, below))
    return multiply(multiply(scale, below), depth), multiply(scale, p), far
