"""Load along the width of teeth: even where pin and tooth are parallel, less towards an end that is tilted or crowned.

Slices side by side, each a spring that is pressed to its own depth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

_STEPS = 100  # of Newton's method, far more than a force of any size takes
_STILL = 1e-14  # step over the depth that changes nothing any more [-]


@dataclass(frozen=True, kw_only=True)
class LineContact:
    """Contacts of pins and teeth as springs side by side along the width of the tooth, theory page equation (31).

    Slices do not feel each other; what follows holds for the linear laws. Under the logarithmic one no disc tilts:
    `peak` is then the even load, and stiffness and `deformation` mean nothing unless the teeth are crowned.

    Examples
    --------
    Crowned by c = 3 µm and s = 2 µm deep in the middle, √(s/c) of the width carries 2/3·C·s·√(s/c).

    >>> own = LineContact(
    ...     force=np.array([2e3 / 3 * 2 * np.sqrt(2 / 3)]), stiffness=np.array([1e9]), slope=np.zeros(1),
    ...     face_width=0.01, crowning=3e-6,
    ... )
    >>> round(1e6 * float(own.deformation[0]), 6)  # [µm]
    2.0
    """

    force: Float[np.ndarray, "*contacts"]  # Normal force [N]
    # Stiffness of the whole width, bending of the pin included unless the teeth are crowned [N/m]
    stiffness: Float[np.ndarray, "*contacts"]
    # By how much the tooth lies deeper in the pin per length along the width [rad]
    slope: Float[np.ndarray, "*contacts"]
    face_width: float  # Width b of the tooth [m]
    crowning: float = 0.0  # Relief c of either end against the middle, a parabola between [m]

    @property
    def _bend(self) -> float:
        """Relief per square of the distance from the middle, 4c/b² [1/m]."""
        return 4.0 * self.crowning / self.face_width**2

    @property
    def _deepest(self) -> Float[np.ndarray, "*contacts"]:
        """How far from the middle the tooth lies deepest, the end where crowning does not outweigh the tilt [m]."""
        end = 0.5 * self.face_width
        if not self.crowning:
            return np.full_like(self.slope, end)
        return np.asarray(np.minimum(np.abs(self.slope) / (2.0 * self._bend), end))

    @property
    def peak(self) -> Float[np.ndarray, "*contacts"]:
        """Line load where it is largest [N/m].

        Without crowning at the deeper end, F/b + C|γ|/2; where one end is lifted, √(2C|γ|F/b).
        """
        if self.crowning:
            return np.asarray(self.stiffness / self.face_width * self._crowned_depth())
        # Force at which the shallower end just touches.
        lifting = 0.5 * self.stiffness * self.face_width * np.abs(self.slope)
        deep = np.where(self.force < lifting, 2.0 * np.sqrt(lifting * self.force), self.force + lifting)
        return np.asarray(deep / self.face_width)

    def _crowned_depth(self) -> Float[np.ndarray, "*contacts"]:
        """Return the largest depth of crowned teeth under their forces, 0 without contact [m].

        On either side of the deepest place the depth is p − gu − ku², k = 4c/b², over the length l up to where it ends
        or lifts; it adds C/b·l(p − gl/2 − kl²/3) to F. That is convex in p, so Newton's steps from above stay above.
        """
        carries = ~(self.force <= 0.0)
        bend, deepest, slope = self._bend, self._deepest[carries], np.abs(self.slope[carries])
        sides = np.stack([0.5 * self.face_width + deepest, 0.5 * self.face_width - deepest])
        # Fall per length at the deepest place: none unless that is an end.
        fall = np.maximum(slope - bend * self.face_width, 0.0)
        asked = self.force[carries] / self.stiffness[carries] * self.face_width
        # From above: were the whole width to follow, its lifted part pulling, this depth would be asked for.
        depth = (asked + (sides**2 * (fall / 2.0 + bend * sides / 3.0)).sum(axis=0)) / self.face_width
        for _ in range(_STEPS):
            length = np.minimum(sides, 2.0 * depth / (fall + np.sqrt(fall**2 + 4.0 * bend * depth)))
            carried = (length * (depth - length * (fall / 2.0 + bend * length / 3.0))).sum(axis=0)
            step = (carried - asked) / length.sum(axis=0)
            depth = depth - step
            if not (np.abs(step) > _STILL * depth).any():
                break
        found = np.zeros_like(self.force)
        found[carries] = depth
        return found

    def of(self, place: tuple[int, ...]) -> LineContact:
        """Return the contacts at a place, the first indices of the arrays [-]."""
        return replace(self, force=self.force[place], stiffness=self.stiffness[place], slope=self.slope[place])

    @property
    def deformation(self) -> Float[np.ndarray, "*contacts"]:
        """Largest compression along the width, 0 without contact [m]."""
        return np.asarray(self.peak * self.face_width / self.stiffness)

    def line_load(self, position: Float[np.ndarray, " position"]) -> Float[np.ndarray, "*contacts position"]:
        """Return the line load at places from −b/2 to b/2 along the width [m], theory page equation (60) [N/m].

        C/b·max(0, s + γz), of crowned teeth less kz² in the brackets; without crowning for linear laws alone.
        """
        slope, deepest = self.slope[..., np.newaxis], self._deepest[..., np.newaxis]
        least = deepest * np.abs(slope) - self._bend * deepest**2
        below = least - slope * position + self._bend * position**2
        rise = self.stiffness[..., np.newaxis] / self.face_width
        return np.asarray(np.maximum(self.peak[..., np.newaxis] - rise * below, 0.0))
