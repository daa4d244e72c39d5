"""How good a frame is, figure by figure: what an operator looks at before he trusts a touch."""

from __future__ import annotations

import numpy as np

from models import Estimate, noise_from_sums
from rig.live.baseline import is_consistent
from rig.live.chain import Chain
from rig.live.fixed_pattern import FixedPattern
from rig.live.frame_estimate import FrameEstimate
from rig.live.snapshot import Sign
from rig.live.visibility import SLIGHT, contrast

NOISY = 1.3  # times the noise of the reference
DIM, BRIGHT = 0.7, 1.3  # times the light of the reference
SOFT = 0.4  # px of blur, from which on a frame says so
STANDING = 0.5  # grey levels, rms: less is there in a good camera
BUMPED = 1.0  # px; a camera on a firm stand creeps by tenths
COARSE = 5.0  # mm, half a fingertip


def signs(chain: Chain, frame_estimate: FrameEstimate) -> tuple[Sign, ...]:
    """Say how good a frame is, of the whole pattern also where a net estimates the touches."""
    sums, tiles = frame_estimate.sums, chain.reference.tiles
    estimate = frame_estimate.from_pattern or frame_estimate.estimate
    visible = 1.0 - frame_estimate.hidden_fraction
    shown = chain.pattern.motions.on_plate & ~frame_estimate.hidden
    noise, at_rest = noise_from_sums(sums, tiles), chain.pixel_noise
    shift = float(np.hypot(*frame_estimate.state.motion[chain.pattern.count :][:2]))
    return (
        Sign("visible pattern", f"{visible:.0%}", visible < 1.0 - SLIGHT),
        _fit(estimate, bool(frame_estimate.unusable_reason)),
        _noise(noise, at_rest),
        _light(contrast(sums, shown, tiles.size) if visible else float("nan")),
        _focus(frame_estimate.blur),
        _sensor(frame_estimate.state.fixed_pattern),
        _pattern(chain, frame_estimate.state.fixed_pattern.level),
        Sign("camera moved", f"{shift:.2f} px", shift > BUMPED),
        _uncertainty(frame_estimate.estimate),
    )


def _fit(estimate: Estimate, unusable: bool) -> Sign:
    if unusable:
        return Sign("misfit", "–", True)
    return Sign(
        "misfit", f"χ² {estimate.chi2 / estimate.dof:.2f} of 1", not is_consistent(estimate)
    )


def _noise(noise: float, at_rest: float) -> Sign:
    return Sign("noise", f"{noise:.1f} grey levels, {at_rest:.1f} at rest", noise > NOISY * at_rest)


def _pattern(chain: Chain, standing: float) -> Sign:
    """Error that too fine a pattern leaves in a tile; it warns where noise leaves less.

    What stands still on the sensor is as fine as noise is, and no lens blurs it.
    """
    reference = chain.reference
    steepness = reference.steepness(chain.pattern.motions.on_plate)
    noise = np.hypot(chain.pixel_noise, standing) / steepness
    aliasing, sigma = reference.aliasing, reference.prefilter.sigma
    too_fine = aliasing > noise
    text = f"{aliasing:.3f} px aliased"
    text += f", Gaussian of {sigma:g} px" if sigma else ""
    return Sign("pattern", f"{text}: defocus" if too_fine else text, too_fine)


def _focus(blur: float) -> Sign:
    if abs(blur) < SOFT:
        return Sign("focus", "as at rest", False)
    return Sign("focus", f"{'blurred' if blur > 0 else 'sharper'} by {abs(blur):.1f} px", True)


def _sensor(found: FixedPattern) -> Sign:
    if found.level >= STANDING:
        return Sign("sensor", f"fixed pattern of {found.level:.1f} grey levels: clean it", True)
    if not found.precision:
        return Sign("sensor", "not known yet", False)
    seen_from = max(found.detectable, STANDING)
    return Sign("sensor", f"clean to {seen_from:.1f} grey levels", False)


def _light(light: float) -> Sign:
    if np.isnan(light):
        return Sign("light", "–", True)
    return Sign("light", f"{light:.0%} of that at rest", not DIM < light < BRIGHT)


def _uncertainty(estimate: Estimate) -> Sign:
    """One standard deviation of the touch that is least sure."""
    if not estimate.count:
        return Sign("touch, σ", "–", False)
    variances = np.diag(estimate.covariance).reshape(-1, 3)
    place = float(np.sqrt((variances[:, 0] + variances[:, 1]).max() / 2))
    force = float(np.sqrt(variances[:, 2].max()))
    return Sign("touch, σ", f"{place:.2g} mm, {force:.2g} N", place > COARSE)
