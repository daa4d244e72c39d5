"""A print with hard edges before the live loop: its prefilter is chosen or set, and said."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import LEVELS, at_rest
from rig.live.quality import signs
from rig.live.reported import report_frame
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

HARD = {"pattern.softness": 0.1}
FORCE = 3.0  # N
PLACES = [(90.0 + 0.7 * k, 120.0 - 0.4 * k) for k in range(10)]  # mm


@pytest.fixture
def chain_and_twin(small):
    """Prepare the chain of a scene that is changed as asked."""

    def make(overrides):
        scene = small(overrides)
        twin = build_twin(scene)
        zero = average_reference([twin.frame(k, ()) for k in range(16)])
        return build_bench(scene, lambda done, total: None).prepare(zero)[0], twin

    return make


def seen_in(chain, image):
    return report_frame(chain, None, image, at_rest(chain), Stopwatch(time.monotonic))


def estimates(chain, twin):
    """Give what is seen of the same force at ten places."""
    for k, (x, y) in enumerate(PLACES):
        yield seen_in(chain, twin.frame(20 + k, (fe.Touch(x, y, FORCE),)))


@pytest.mark.slow
def test_forces_on_a_hard_print_are_right_behind_the_chosen_filter(chain_and_twin):
    """Aliasing makes motion look too small, and the filter leaves a third of that."""
    bias = {}
    for given in ("auto", 0.0):
        chain, twin = chain_and_twin(HARD | {"dic.prefilter": given})
        found = list(estimates(chain, twin))
        assert all(each.estimate.count == 1 for each in found)
        assert not any(each.hidden.any() for each in found)
        forces = np.array([each.estimate.force[0] for each in found])
        sigma = np.sqrt([each.estimate.covariance[2, 2] for each in found])
        bias[given] = abs(forces.mean() - FORCE)
        assert (np.abs(forces - FORCE) < 4.0 * sigma).all()
    assert bias["auto"] < 0.03 * FORCE
    assert bias["auto"] < 0.5 * bias[0.0]


@pytest.mark.slow
@pytest.mark.parametrize("force", [1.0, 40.0])
def test_a_touch_scatters_by_the_noise_of_its_own_motion(chain_and_twin, force):
    """Aliasing is there under a strong touch alone, and stays as it is from frame to frame.

    Forces may be wrong by what it takes of small motions, which the spectrum of the print says.
    """
    chain, twin = chain_and_twin(HARD | {"dic.prefilter": 0.0})
    assert chain.noise > 1.2 * chain.pixel_noise
    touch = fe.Touch(90.0, 120.0, force)
    found = [seen_in(chain, twin.frame(20 + k, (touch,))).estimate for k in range(144)]
    known = np.mean([each.systematic for each in found], axis=0)
    noise = np.mean([each.covariance for each in found], axis=0) - known
    seen = np.array([[*each.xy[0], each.force[0]] for each in found])
    z = (seen - seen.mean(axis=0)) / np.sqrt(np.diag(noise))
    assert np.sqrt((z**2).sum() / (z.size - 3)) == pytest.approx(1.0, abs=0.25)
    assert abs(seen[:, 2].mean() - force) < 3.0 * np.sqrt(known[2, 2])
    aliased = known[0, 0] / noise[0, 0]
    assert aliased < 0.05 if force == 1.0 else aliased > 0.1


def test_a_weak_touch_is_found_by_the_noise_of_its_own_motion(chain_and_twin):
    """By that of any motion, thrice as large, the plate would have to be pressed by 3 N."""
    chain, twin = chain_and_twin(HARD | {"dic.prefilter": 0.0})
    assert chain.noise > 2.0 * chain.pixel_noise
    draw, found = np.random.default_rng(5), []
    for k in range(24):
        touch = fe.Touch(*draw.uniform(40.0, 160.0, 2), force=1.0)
        seen = seen_in(chain, twin.frame(100 + k, (touch,)))
        assert seen.level < 0.5
        found.append(seen.estimate.count)
    assert max(found) == 1
    assert sum(found) > 16


def test_a_frame_is_searched_by_no_less_than_its_noise_and_by_a_fifth_more_at_most(chain_and_twin):
    chain, _ = chain_and_twin(HARD | {"dic.prefilter": 0.0})
    bare = np.zeros(len(chain.reference.hessian), bool)
    levels = []
    for shift in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.8, 1.0):
        motion = chain.pattern.still()
        motion[chain.pattern.count :][:2] = shift
        levels.append(chain.level(motion, bare, 1.0))
        errors = chain.motion_errors(motion, bare, 1.0, levels[-1])
        assert errors.pixels + errors.aliased > LEVELS**2 - 1e-9
        assert errors.pixels + errors.aliased < 1.0 + 1e-9
    assert levels[0] == levels[-1] < 0.5
    assert levels[5] > 1.3
    assert levels[:6] == sorted(levels[:6])


def test_a_camera_that_drifts_by_a_part_of_a_pixel_is_not_strange(chain_and_twin):
    """Of 0.35 px along both axes aliasing leaves more than of a usual motion."""
    chain, twin = chain_and_twin(HARD | {"dic.prefilter": 0.0})
    drifted = replace(twin, shift=(0.35, -0.35))
    seen = [seen_in(chain, drifted.frame(1000 + k, ())) for k in range(12)]
    assert all(each.level > 1.0 for each in seen)
    assert not any(each.estimate.count for each in seen)
    assert min(each.estimate.p_value for each in seen) > 1e-4


def test_nothing_is_found_on_a_hard_print_at_rest_and_its_noise_is_as_it_is_stated(chain_and_twin):
    chain, twin = chain_and_twin(HARD | {"dic.prefilter": 0.0})
    seen = [seen_in(chain, twin.frame(20 + k, ())) for k in range(40)]
    assert not any(each.estimate.count for each in seen)
    assert all(each.level < 0.5 for each in seen)
    p = np.array([each.estimate.p_value for each in seen])
    assert p.min() > 1e-3
    assert np.median(p) < 0.99


@pytest.mark.parametrize(
    ("overrides", "sigma"),
    [({}, 0.0), (HARD, 0.8), (HARD | {"dic.prefilter": "1.2 px"}, 1.2)],
)
def test_the_filter_is_chosen_or_set_and_stands_with_the_pattern(chain_and_twin, overrides, sigma):
    chain, twin = chain_and_twin(overrides)
    assert chain.reference.prefilter.sigma == sigma
    image = twin.frame(20, ())
    frame_estimate = seen_in(chain, image)
    (sign,) = (each for each in signs(chain, frame_estimate) if each.name == "pattern")
    assert (f"Gaussian of {sigma:g} px" in sign.says) == (sigma > 0)
    if not sigma:
        assert chain.noise == chain.pixel_noise
        assert frame_estimate.level == 1.0
