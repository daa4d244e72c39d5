"""What some subsets leave over, on a device: is it white noise, and is it one motion.

The same questions as `dic.correlation.residuals` and `dic.correlation.jumps`, of which the second
is only asked whether a break may be there at all.
"""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dic.correlation.breaks import JUMP, PLAIN
from dic.correlation.device_reference import DeviceReference
from dic.correlation.device_sums import sample
from dic.correlation.jumps import SIDE
from dic.correlation.residuals import FEWEST, SAMPLES

if TYPE_CHECKING:
    from torch import Tensor

_LOUDEST = 256  # subsets in which a break is looked for; where more are loud the host looks


class Rest(NamedTuple):
    """What the fit of M subsets of side S leaves over.

    Attributes
    ----------
    texture : (M, 4, S²) float64
    jacobian : (M, K, S²) float64
    rest : (M, S²) float64
        Grey levels of the reference.
    squares : (M,) float64
        Its sum of squares.
    """

    texture: Tensor
    jacobian: Tensor
    rest: Tensor
    squares: Tensor


def noise_excess(known: DeviceReference, motion: Tensor, spline: Tensor, valid: Tensor) -> Tensor:
    """Variance of Σ ∇f r over that of the noise assumed, (2,), as `residuals.excess`."""
    import torch

    one = torch.ones_like(known.block_gain)
    here, taken = _sampled(valid & known.sampled)
    left = leave_over(known, motion, spline, here)
    size, side = known.inverse.shape[1], known.blocks.shape[1]
    variance = left.squares / (known.light[here, 2] - size).clamp(min=1.0)
    slopes = left.texture[:, :2]
    sums = (slopes * left.rest[:, None]).reshape(-1, 2, side, side)
    within = known.blocks @ sums @ known.blocks.T
    usual = variance[:, None] * slopes.square().sum(2)
    ratios = within.square().sum(dim=(2, 3)) / usual
    seen = taken & torch.isfinite(ratios).all(1) & (usual > 0).all(1)
    count = seen.sum()
    mean = ratios.masked_fill(~seen[:, None], 0.0).sum(0) / count.clamp(min=1)
    return (mean / known.block_gain).clamp(min=1.0).where(count >= FEWEST, one)


def _sampled(among: Tensor) -> tuple[Tensor, Tensor]:
    """Take some of the points `among` as `newton.sampled`: (SAMPLES,), and which are taken."""
    import torch

    rank = among.cumsum(0)
    count, place = rank[-1], torch.arange(SAMPLES, device=among.device)
    spread = place * (count - 1) // (SAMPLES - 1)
    chosen = torch.where(count > SAMPLES, spread, place)
    here = torch.searchsorted(rank, chosen + 1).clamp(max=len(among) - 1)
    return here, chosen < count


def may_be_broken(known: DeviceReference, motion: Tensor, spline: Tensor, louder: Tensor) -> Tensor:
    """Whether a jump along some line takes more of any of the loudest subsets than noise does.

    Parameters
    ----------
    louder : (N,) float64
        Noise of each point over the usual noise; 0 where no break is looked for.

    Returns
    -------
    () bool
        Also where more than some hundred points are loud.
    """
    import torch

    level, here = louder.topk(min(_LOUDEST, len(louder)))
    left = leave_over(known, motion, spline, here)
    fx, fy = left.texture[:, 0], left.texture[:, 1]
    light = torch.stack([fx * left.rest, fy * left.rest, fx * fx, fx * fy, fy * fy], 1)
    terms = torch.cat([light, fx[:, None] * left.jacobian, fy[:, None] * left.jacobian], 1)
    chi, jump = _jumps(terms @ known.sides.T, terms.sum(2), known.inverse[here])
    best, line = chi.max(1)
    freedom = (known.light[here, 2] - known.inverse.shape[1] - 2).clamp(min=1.0)
    noise = torch.maximum(left.squares - best, 1e-6 * left.squares) / freedom
    size = jump.gather(2, line[:, None, None].expand(-1, 2, 1))[..., 0].norm(dim=1)
    of_jump = best / noise / known.noise_gain[here].mean(1)
    plain = of_jump * level.clamp(min=1.0).square() > PLAIN
    broken = (level > 0) & plain & (size > JUMP)
    return broken.any() | ((louder > 0).sum() > _LOUDEST)


def leave_over(known: DeviceReference, motion: Tensor, spline: Tensor, here: Tensor) -> Rest:
    """Fit the subsets `here` (M,) once more, each warped by its own motion."""
    import torch

    (height, width), half = known.image.shape, known.blocks.shape[1] // 2
    arm = torch.arange(-half, half + 1, device=here.device)
    eta, xi = (axis.reshape(-1) for axis in torch.meshgrid(arm, arm, indexing="ij"))
    centre = known.xy[here].round().long()
    x, y = centre[:, :1] + xi, centre[:, 1:] + eta
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    texture = known.texture[:, y.clamp(0, height - 1), x.clamp(0, width - 1)].double()
    fx, fy, f, weight = texture * inside
    moved = (motion[here] @ known.monomials).float()
    g = sample(spline, (x.float(), y.float()), (moved[:, 0], moved[:, 1])).double() * weight
    slopes = (fx[:, None] * known.monomials, fy[:, None] * known.monomials)
    jacobian = torch.cat([*slopes, -f[:, None], -weight[:, None]], 1)
    towards = (jacobian @ g[..., None])[..., 0]
    pixels = known.light[here, 2].clamp(min=1.0)
    contrast = (g.square().sum(1) - towards[:, -1] ** 2 / pixels).clamp(min=1e-30)
    gain = (contrast / known.contrast[here].clamp(min=1e-30)).sqrt()[:, None]
    step = -(known.inverse[here] @ (towards / gain)[..., None])
    rest = g / gain + (step.mT @ jacobian)[:, 0]
    return Rest(torch.stack([fx, fy, f, weight], 1), jacobian, rest, rest.square().sum(1))


def _jumps(beyond: Tensor, whole: Tensor, inverse: Tensor) -> tuple[Tensor, Tensor]:
    """χ² (M, L) and size (M, 2, L) of jumps of what lies beyond lines, as `jumps.jumps`."""
    import torch

    size = inverse.shape[1]
    along_x, along_y = beyond[:, 5 : 5 + size], beyond[:, 5 + size :]
    of_x, of_y = inverse @ along_x, inverse @ along_y
    xx = beyond[:, 2] - (along_x * of_x).sum(1)
    xy = beyond[:, 3] - (along_x * of_y).sum(1)
    yy = beyond[:, 4] - (along_y * of_y).sum(1)
    determinant = xx * yy - xy * xy
    own, every = beyond[:, 2] + beyond[:, 4], (whole[:, 2] + whole[:, 4])[:, None]
    seen = (xx > 0) & (yy > 0) & (determinant > 1e-3 * xx * yy)
    seen &= torch.minimum(own, every - own) >= SIDE * every
    u = (yy * beyond[:, 0] - xy * beyond[:, 1]) / determinant
    v = (xx * beyond[:, 1] - xy * beyond[:, 0]) / determinant
    chi = torch.where(seen, u * beyond[:, 0] + v * beyond[:, 1], 0.0)
    return chi, torch.stack([u, v], 1)
