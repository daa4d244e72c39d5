"""How a lens bends the rays of a pinhole: the model of Brown and Conrady, as OpenCV orders it."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from synthetic.arrays import F64

# Newton's method doubles its digits a step; from the ray that a pinhole would see it needs 3 to 6.
_MAX_STEPS = 30
_TOLERANCE = 1e-13  # of a ray, tangent of an angle: 1e-10 px at a focal length of 1000 px


@dataclass(frozen=True)
class Distortion:
    """Radial (k) and tangential (p) distortion of rays (x, y, 1).

    With r² = x² + y², a ray is seen where the pinhole would see

        x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²),
        y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y.

    Raises
    ------
    ValueError
        A coefficient that is not finite.

    References
    ----------
    Brown 1971, Close-range camera calibration, Photogrammetric Engineering 37, 855.
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    def __post_init__(self):
        values = [getattr(self, field.name) for field in fields(self)]
        if not np.isfinite(values).all():
            raise ValueError(f"lens distortion must be finite, got k1, k2, p1, p2, k3 = {values}")

    @cached_property
    def reach(self) -> float:
        """Tangent of the angle off the axis at which the radial part turns back; may be inf."""
        # With s = 1/r² the derivative 1 + 3 k1 r² + 5 k2 r⁴ + 7 k3 r⁶ is a cubic that leads with 1.
        roots = np.roots([1.0, 3 * self.k1, 5 * self.k2, 7 * self.k3])
        turns = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 1e-12)]
        return float(1 / np.sqrt(turns.max())) if len(turns) else np.inf

    def bend(self, ray: F64) -> F64:
        """Distort rays (K, 2), tangents of angles; ValueError beyond `reach`."""
        widest = np.sqrt(np.square(ray).sum(axis=1).max(initial=0.0))
        if not widest < self.reach:
            raise ValueError(
                f"rays through the lens must stay within {self.reach:.3g} off the axis, where its "
                f"distortion turns back, got {widest:.3g}; use weaker distortion or a longer focal "
                "length"
            )
        return self._bend(ray)

    def jacobian(self, ray: F64) -> F64:
        """Differentiate `bend`: (K, 2, 2), symmetric."""
        x, y = ray.T
        r2 = x * x + y * y
        radial, slope = self._radial(r2)
        xx = radial + 2 * x * x * slope + 2 * self.p1 * y + 6 * self.p2 * x
        yy = radial + 2 * y * y * slope + 6 * self.p1 * y + 2 * self.p2 * x
        xy = 2 * x * y * slope + 2 * self.p1 * x + 2 * self.p2 * y
        return np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)

    def straighten(self, bent: F64) -> F64:
        """Find the rays (K, 2) that `bend` sends to `bent`, to 1e-13.

        Raises
        ------
        ValueError
            No ray is sent there.
        """
        ray, off = bent, np.full_like(bent, np.inf)
        for _ in range(_MAX_STEPS):
            with np.errstate(all="ignore"):  # what runs away is counted below
                off = bent - self._bend(ray)
                (a, b), (_, d) = self.jacobian(ray).transpose(1, 2, 0)
                right = np.stack([d * off[:, 0] - b * off[:, 1], a * off[:, 1] - b * off[:, 0]])
                ray = ray + (right / (a * d - b * b)).T
            if np.abs(off).max(initial=0.0) < _TOLERANCE:
                break
        found = (np.abs(off).max(axis=1) < _TOLERANCE) & (
            np.square(ray).sum(axis=1) < self.reach**2
        )
        if not found.all():
            raise ValueError(
                f"the lens must send a ray to every pixel, got {np.count_nonzero(~found)} of "
                f"{len(bent)} pixels beyond the {self.reach:.3g} off the axis at which its "
                "distortion turns back; use a smaller image or weaker distortion"
            )
        return ray

    def _bend(self, ray: F64) -> F64:
        x, y = ray.T
        r2 = x * x + y * y
        radial, _ = self._radial(r2)
        across = 2 * x * y
        return np.column_stack(
            [
                x * radial + self.p1 * across + self.p2 * (r2 + 2 * x * x),
                y * radial + self.p2 * across + self.p1 * (r2 + 2 * y * y),
            ]
        )

    def _radial(self, r2: F64) -> tuple[F64, F64]:
        """Radial factor and its derivative by r²."""
        factor = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return factor, self.k1 + r2 * (2 * self.k2 + r2 * 3 * self.k3)
