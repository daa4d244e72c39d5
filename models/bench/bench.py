"""What is known of a bench: its numbers, their covariance, and how well the model fits at best."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, nan, sqrt

import numpy as np

import fe
from models.arrays import F64, Mask
from models.forward.bench_forward import BENCH
from models.forward.camera_change import CAMERA

NAMES = tuple(name for name, _ in BENCH)
UNITS = dict(BENCH)

# Error of the model beside its numbers, as a fraction of what a touch moves: the modal plate was
# right to it against the whole plate up to 4 N, given all numbers.
DISCREPANCY = 0.004
MEMORY = 0.05
"""Fraction of a touch that a usual plate may still show when it has ended."""
_KNOWN = 0.5  # of the prior's σ, above which presses do not determine a number


@dataclass(frozen=True)
class HeldOut:
    """Errors of known presses, each left out of the bench that finds it.

    Attributes
    ----------
    place : float, mm
        RMS distance.
    force : float
        RMS error as a fraction of the force; NaN where no force was known.
    count : int
        Presses of known place, those that contradict the others left out.
    """

    place: float
    force: float
    count: int


@dataclass(frozen=True, eq=False)
class BenchEstimate:
    """Numbers of a bench and how sure they are.

    Attributes
    ----------
    values : (63,) float64
        In the order of `BENCH`.
    covariance : (63, 63) float64
    discrepancy : float
        Error of the model beside them, a fraction of what a touch moves.
    prior : (63,) float64
        Standard deviations before any press.
    memory : float
        Fraction of a touch that the plate may still show when it has ended, its standard deviation.
    held_out : HeldOut, optional
        None before presses.
    converged : bool
        Whether the descent of `identify` ended by itself.
    outliers : tuple of int
        Presses whose place or force does not agree with the others.
    label_offset : tuple of float, mm
        By which the listed places lie to one side of those that the presses show, along x and y; 0
        where chance explains it. Where the camera sees the plate is less sure by as much.
    label_sigma : (float, float)
        Typical standard deviations of listed places, mm, and of forces, as a fraction, as the
        presses show them; NaN where none is known.
    touches : (N, 3) float64, mm, mm, N
        Most likely x, y, F of each press.
    measured : tuple of str
        Numbers that were measured together before any press, as a camera is by boards: of these
        alone the prior has correlations, and none is a cause that may be absent.
    fixed_pattern : (float, float)
        Variance of a pattern of the sensor, which stands still while the plate moves, and its
        standard deviation, grey levels²; infinite where none is known.
    shown : BenchEstimate, optional
        What presses show with all numbers free, where only some of them were asked for; else None.
    """

    values: F64
    covariance: F64
    discrepancy: float
    prior: F64
    memory: float = MEMORY
    held_out: HeldOut | None = None
    converged: bool = True
    outliers: tuple[int, ...] = ()
    label_offset: tuple[float, float] = (0.0, 0.0)
    label_sigma: tuple[float, float] = (nan, nan)
    touches: F64 = field(default_factory=lambda: np.empty((0, 3)))
    measured: tuple[str, ...] = ()
    fixed_pattern: tuple[float, float] = (0.0, inf)
    shown: BenchEstimate | None = None

    @property
    def sigma(self) -> F64:
        """Standard deviation of each number, (63,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def is_sound(self) -> bool:
        """Whether the numbers are finite and their covariance is one."""
        unit = np.where(self.prior > 0, self.prior, 1.0)
        even = self.covariance / np.outer(unit, unit)
        finite = np.isfinite(self.values).all() and np.isfinite(even).all()
        return bool(finite and np.linalg.eigvalsh(even)[0] > -1e-9)

    @property
    def is_prior(self) -> bool:
        """Whether no press and no touch has shown anything of it yet."""
        return bool(np.allclose(self.sigma, self.prior))

    @property
    def known(self) -> Mask:
        """Which numbers the presses determine, (63,)."""
        return self.sigma < _KNOWN * self.prior

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the numbers that the presses cannot tell."""
        return tuple(name for name, known in zip(NAMES, self.known, strict=True) if not known)

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Value and standard deviation of a number by its name."""
        index = NAMES.index(name)
        return float(self.values[index]), float(self.sigma[index])


def bench_before(plate: fe.Plate, **sigma: float) -> BenchEstimate:
    """State what is known of a bench before any press.

    Parameters
    ----------
    plate : fe.Plate
    sigma : float
        Standard deviations by name, in place of those of a usual bench, see `prior_sigma`.

    Raises
    ------
    ValueError
        A name is none of `BENCH`, or a standard deviation is not positive or 0.
    """
    prior = prior_sigma(plate)
    for name, value in sigma.items():
        if name not in NAMES:
            raise ValueError(f"no bench has a {name!r}; use one of {', '.join(NAMES)}")
        if not 0 <= value < np.inf:
            raise ValueError(
                f"sigma of {name} must be 0 or more, got {value:g} {UNITS[name]}; give what may be"
            )
        prior[NAMES.index(name)] = value
    return BenchEstimate(np.zeros(len(NAMES)), np.diag(prior**2), DISCREPANCY, prior)


def with_camera(bench: BenchEstimate, covariance: F64) -> BenchEstimate:
    """State what is known of a camera that boards were seen by, before any press.

    That adds to what is known of a usual bench: no direction is less sure than before.

    Parameters
    ----------
    bench : BenchEstimate
        Before any press, its camera that which the boards show.
    covariance : (9, 9) float64
        What the boards leave of the numbers of `CAMERA`.
    """
    numbers = slice(len(NAMES) - len(CAMERA), len(NAMES))
    usual = bench.covariance[numbers, numbers]
    both = usual + covariance
    unit = np.sqrt(np.diag(both))
    even = np.linalg.solve(both / np.outer(unit, unit), covariance / unit[:, None])
    known = (usual / unit) @ even
    whole = bench.covariance.copy()
    whole[numbers, numbers] = 0.5 * (known + known.T)
    prior = bench.prior.copy()
    prior[numbers] = np.sqrt(np.diag(whole)[numbers])
    measured = tuple(name for name, _ in CAMERA)
    return replace(bench, covariance=whole, prior=prior, measured=measured)


def correlation_root(bench: BenchEstimate, free: Mask) -> F64:
    """Return the lower Cholesky factor of the correlations of a prior among free numbers, (P, P).

    That of one for what was not measured together.
    """
    root = np.eye(int(free.sum()))
    together = np.array([name in bench.measured for name in NAMES]) & free
    if together.any():
        sigma, places = bench.sigma[together], np.flatnonzero(together[free])
        even = bench.covariance[np.ix_(together, together)] / np.outer(sigma, sigma)
        root[np.ix_(places, places)] = np.linalg.cholesky(even)
    return root


def prior_sigma(plate: fe.Plate) -> F64:
    """Return standard deviations (63,) of a bench built with care and measured with a ruler.

    Compliances are in parts of the plate's own, tension is that of half a kelvin of PVC.
    """
    side = sqrt(plate.area)
    stiff = plate.young * plate.thickness
    turning, stretching = 0.01 * side / plate.rigidity, 0.15 * side / stiff
    tension = 3.5e-5 * stiff / (1.0 - plate.poisson)
    usual: dict[str, float] = {
        "young": 0.1,
        "thickness": 0.03,
        "tension_xx": tension,
        "tension_yy": tension,
        "tension_xy": 0.3 * tension,
        "sag": 0.15,
        "sag_x": 0.1,
        "sag_y": 0.1,
        "sag_xx": 0.1,
        "sag_xy": 0.1,
        "sag_yy": 0.1,
        "turn_x": 0.01,
        "turn_y": 0.01,
        "turn_z": 0.01,
        "shift_x": 1.5,
        "shift_y": 1.5,
        "shift_z": 2.0,
        "focal": 0.01,
        "k1": 0.04,
        "k2": 0.04,
    }
    for name in NAMES:
        if name.startswith(("rotation", "membrane")):
            whole = turning if name.startswith("rotation") else stretching
            usual[name] = 0.5 * whole if name.endswith("slope") else whole
        elif name.startswith("thickness_"):
            usual[name] = 0.02 / len(name.removeprefix("thickness_"))
    return np.array([usual[name] for name in NAMES])
