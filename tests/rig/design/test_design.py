"""`touchplate design`: what it promises is what a simulated run of the scene then shows."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from typer.testing import CliRunner

import fe
import models
import rig
from dic import lay_tiles
from models.design.expected_errors import shape_over
from rig import cli
from rig.calibration.store import calibration_beside
from rig.commands.design import _place
from rig.design.changes import changes
from rig.design.limits import refusal
from rig.design.outlook import design, in_modes, known_of, outlook, search_for
from rig.design.prediction import linear_to, patch_of, predict, remaining_gain
from rig.design.setup import setup_of
from rig.design.unknowns import GROUPS, unknowns
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.scene.theory import choose
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch


def quiet(*_):
    pass


def test_more_force_than_the_linear_limit_needs_large_theory(small):
    plate = small().plate.build()
    limit = linear_to(plate)
    assert fe.linear_range(plate, 0.97 * limit).theory == "linear"
    assert fe.linear_range(plate, 1.03 * limit).theory == "large"


def test_changes_change_one_thing_each(small):
    given = setup_of(small({"pattern.contrast": 0.6}))
    rows = list(changes(given))
    assert len(rows) == 9
    for _, before, after, changed in rows:
        assert before != after
        parts = ("plate", "camera", "pattern", "sensor", "dic", "frames")
        assert sum(getattr(given, part) != getattr(changed, part) for part in parts) == 1


@pytest.mark.slow
def test_an_outlook_is_what_a_design_says_of_the_same(small):
    scene = small({"pattern.contrast": 0.6})
    whole, part = design(scene, quiet), outlook(scene)
    np.testing.assert_array_equal(part.errors.place, whole.errors["pattern"].place)
    assert (part.changes, part.linear_to) == (whole.changes, whole.linear_to)


@pytest.mark.slow
def test_changes_are_worth_what_theory_says(small):
    made = design(small({"pattern.contrast": 0.6}), quiet)
    gains = {change.what: change.gain for change in made.changes}
    given = setup_of(small())
    assert gains["sensor noise"] == pytest.approx(
        given.perfect_noise / np.sqrt((2.0 / 1.25) ** 2 + 1 / 12)
    )
    assert gains["mean of frames"] == pytest.approx(np.sqrt((1 + 1 / 16) / (1 / 4 + 1 / 16)))
    assert gains["reference frames"] == pytest.approx(np.sqrt((1 + 1 / 16) / (1 + 1 / 64)))
    assert 1.18 < gains["speckle contrast"] < 1.25  # 1.216: speckles that overlap gain less
    assert gains["thickness"] > gains["stand-off"] > 1.05
    order = [change.gain for change in made.changes]
    assert order == sorted(order, reverse=True)
    assert (made.errors["bound"].place < made.errors["pattern"].place).all()
    assert (made.errors["pattern"].place < made.errors["strain"].place).all()
    limits = {change.what: change.linear_to for change in made.changes}
    assert limits["stand-off"] == made.linear_to < made.largest == 4.0
    assert limits["thickness"] == pytest.approx(
        made.linear_to / 1.25**4, rel=0.02
    )  # F ~ D w, w ~ h


@pytest.mark.slow
def test_what_is_shared_is_not_computed_again(small):
    now = predict(setup_of(small()))
    louder = replace(now.setup, frames=4)
    again = predict(louder, like=now)
    assert again.unit is now.unit
    assert again.energy == now.energy
    np.testing.assert_allclose(again.errors.place, predict(louder).errors.place)


@pytest.mark.slow
def test_what_interpolation_leaves_of_a_pattern_is_part_of_the_errors(small):
    """The patch is moved by its exact shift, so that fine speckles alias as in a camera."""
    fine, coarse = (
        setup_of(small({"pattern.diameter": speckle * millimetres_per_pixel(small)}))
        for speckle in (2.0, 7.0)
    )
    left, more_left = (abs(remaining_gain(each, patch_of(each))) for each in (coarse, fine))
    assert left < 5e-4
    assert more_left > 2 * left
    # With all motion too large by a part, a force is too large by it, while motions are small.
    np.testing.assert_allclose(added_by_interpolation(fine, 0.02), 1.0, rtol=0.02)
    # Linear theory has any force; that of a motion of half a pixel and more is less so.
    assert np.median(added_by_interpolation(fine, 1000.0)) < 0.7


def added_by_interpolation(given, force):
    """Error of a force in parts of it and of what interpolation leaves of small motions."""
    promised = predict(given, None, force)
    unavoidable = promised.at_noise(promised.noise(promised.aliased))
    added = np.sqrt(promised.errors.force**2 - unavoidable.force**2)
    return added / abs(promised.gain) / force


def millimetres_per_pixel(small):
    scene = small()
    camera = scene.camera.build(scene.plate)
    middle = np.array(camera.size) / 2
    first, second = camera.on_plate(np.array([middle, [middle[0] + 1, middle[1]]]), 0.0)
    return float(np.linalg.norm(second - first))


def test_images_that_are_too_small_are_refused(small):
    with pytest.raises(ValueError, match=r"images of 64 × 64 px in tiles of 4 px cannot tell"):
        design(small({"camera.pixels": [64, 64], "dic.tile": 4}), quiet)


def test_a_scene_without_a_camera_or_with_a_bent_plate_is_refused(small):
    import rig

    with pytest.raises(ValueError, match=r"cannot be designed; it needs \[plate\], \[camera\]"):
        design(rig.load("paper-one"), quiet)
    with pytest.raises(ValueError, match=r"has a bent plate, and a design takes it as flat"):
        design(small({"base.bend": 2.0}), quiet)


@pytest.mark.slow
def test_the_command_prints_writes_and_draws(small_settings, tmp_path):
    image = tmp_path / "map.png"
    arguments = ["design", "twin", "--json", f"--plot={image}", *small_settings]
    done = CliRunner().invoke(cli.application(arguments), arguments)
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)
    assert image.read_bytes().startswith(b"\x89PNG")
    assert set(said["at_1_n"]) == {"bound", "pattern", "strain"}
    assert said["at_1_n"]["pattern"]["place_median_mm"] > 0
    assert 0 < said["fps"] <= 30
    assert len(said["map"]["rows"]) == np.prod(shape_over((254.0, 203.0)))


def test_a_place_that_a_guess_would_find_as_well_is_not_found():
    side = 203.0
    guesses = np.random.default_rng(3).uniform(0, side, 200_000)
    assert _place(1.02 * guesses.std(), side) == "not found"
    assert _place(0.98 * guesses.std(), side).endswith(" mm")


def test_every_number_of_a_bench_is_named_once_by_what_it_is():
    names = [name for _, numbers in GROUPS.items() for name in numbers]
    assert len(names) == len(set(names))
    assert {"young", "thickness"} < set(names)


def test_a_calibration_counts_for_the_bench_that_it_was_made_on():
    scene, stored = rig.load("bench-real"), calibration_beside("bench-real")
    before, shown = known_of(scene, setup_of(scene), stored)
    assert (shown.sigma < before.sigma).mean() > 0.8
    exact = rig.load("bench-real", {"estimator.bench": "exact"})
    assert known_of(exact, setup_of(exact), stored) is not None
    assert known_of(exact, setup_of(exact), None) is None
    other = rig.load("bench-real", {"plate.size": [254, 203]})
    assert known_of(other, setup_of(other), stored)[1] is None


@pytest.mark.slow
def test_a_bench_that_is_known_ten_times_as_well_promises_less_than_before_presses(small):
    thin = {"plate.thickness": 0.8, "plate.theory": "large", "estimator.bench": "usual"}
    scene = small(thin)
    modal = in_modes(scene, choose(scene, scene.plate, 2.0), setup_of(scene))
    before = models.bench_before(scene.plate.build())
    after = replace(before, covariance=0.01 * before.covariance)
    found = unknowns(predict(setup_of(scene)), modal, 2.0, before, after)
    assert np.median(found.before.place) > 2 * np.median(found.calibrated.place)
    assert np.median(found.before.force) > 2 * np.median(found.calibrated.force)


def test_a_image_that_cannot_be_written_is_refused_at_once(tmp_path):
    arguments = ["design", "twin", f"--plot={tmp_path}/none/map.png"]
    done = CliRunner().invoke(cli.application(arguments), arguments)
    assert "must be a *.png in a folder that exists" in str(done.exception)


@pytest.mark.slow
def test_a_search_finds_what_reaches_an_error(small):
    scene = small()
    now = float(np.median(predict(setup_of(scene), None, 0.5).errors.place))
    found = search_for(scene, 0.6 * now, None)
    assert found.now == pytest.approx(now)
    assert found.force == 0.5
    assert found.reached
    named = {step.what: step for step in found.alone}
    assert list(named)[:3] == ["speckle diameter", "mean of frames", "thickness"]
    thinner = small({"plate.thickness": named["thickness"].after})
    reached = float(np.median(predict(setup_of(thinner), None, 0.5).errors.place))
    assert 0.57 * now < reached < 0.601 * now
    assert named["mean of frames"].after == 4  # (1/4 + 1/16) / (1 + 1/16) < 0.6², and not with 3


@pytest.mark.slow
def test_speckles_are_made_finer_as_little_as_is_needed(small):
    """As little of the way is gone as reaches the error, though all of it would do."""
    scene = small({"pattern.diameter": 3.5 * 1.4})
    now = float(np.median(predict(setup_of(scene), None, 0.5).errors.place))
    found = {step.what: step for step in search_for(scene, 0.7 * now, None).alone}
    finer = small({"pattern.diameter": found["speckle diameter"].after})
    reached = float(np.median(predict(setup_of(finer), None, 0.5).errors.place))
    assert 0.67 * now < reached < 0.701 * now


@pytest.mark.slow
def test_a_search_says_where_it_ends(small):
    found = search_for(small(), 1e-4, 0.5)
    assert not found.reached
    assert not found.alone
    assert len(found.together) >= 4
    assert found.together[-1].place > 1e-4
    at_once = search_for(small(), 1e4, 0.5)
    assert at_once.reached
    assert not at_once.alone
    for place, force in ((0.0, 1.0), (0.5, -1.0)):
        with pytest.raises(ValueError, match="must be more than 0"):
            search_for(small(), place, force)


@pytest.mark.slow
def test_what_cannot_work_is_refused_with_a_remedy(small):
    assert not refusal(small())
    fine = refusal(small({"pattern.diameter": 0.5}))
    assert "px wide in the image" in fine
    assert "set pattern.diameter to" in fine
    assert "set thickness to" in refusal(small({"plate.thickness": 8.0}))


@pytest.mark.slow
def test_large_touches_are_predicted_as_the_reduced_plate_has_them(small):
    scene = small({"plate.thickness": 1.0, "plate.theory": "large"})
    given = setup_of(scene)
    bent = models.large_plate(fe.reduced_plate(given.plate.build(), force=4.0))
    view = given.camera.build(given.plate)
    tiles = lay_tiles((view.size[1], view.size[0]), given.tile)
    motions = models.prepare_motions(bent.modes, view, 0.5, tiles, bent, models.with_tilts)
    found = predict(given, None, 4.0, fe.modal_plate(given.plate.build()))
    pattern = models.prepare_pattern(motions, models.equal_tiles(tiles, found.energy))
    bound = found.at_noise(given.noise)
    inside = np.abs(bound.touches[:, :2] - [127.0, 101.5]).max(axis=1) < 70.0
    reduced = models.expected_errors(pattern.forward(given.noise), bound.touches[inside])
    np.testing.assert_allclose(bound.place[inside], reduced.place, rtol=0.06)
    np.testing.assert_allclose(bound.force[inside], reduced.force, rtol=0.06)


@pytest.mark.slow
def test_predicted_errors_are_those_of_a_simulated_run(small):
    scene = small(
        {
            "camera.pixels": [512, 416],
            "pattern.diameter": 2.6,
            "touches.force": [2, 4],
            "touches.max_touches": 1,
            "source.script": "random",
            "estimator.modes": 200,
        }
    )
    errors = predict(setup_of(scene)).errors
    twin = build_twin(scene)
    bench = build_bench(scene, quiet)
    zero = average_reference([twin.frame(k, ()) for k in range(bench.reference_frames)])
    chain, _ = bench.prepare(zero)
    place, force = over(scene.plate.size, errors.place), over(scene.plate.size, errors.force)
    off, push = [], []
    for number in range(100, 350):
        (touch,) = twin.touches(number)
        image = twin.frame(number, (touch,))
        found = estimate_frame(chain, image, at_rest(chain), Stopwatch(lambda: 0.0)).estimate
        assert found.count == 1
        away = np.linalg.norm(found.xy[0] - (touch.x, touch.y))
        off.append(away / place((touch.y, touch.x)) * touch.force)
        push.append((found.force[0] - touch.force) / force((touch.y, touch.x)))
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.15)  # measured 1.06
    assert np.sqrt(np.mean(np.square(push))) == pytest.approx(1.0, abs=0.15)  # measured 1.05


def over(size, values):
    """Interpolate a quantity of the map between its cells."""
    columns, rows = shape_over(size)
    x, y = ((np.arange(n) + 0.5) * side / n for n, side in zip((columns, rows), size, strict=True))
    logs = RegularGridInterpolator((y, x), np.log(values.reshape(rows, columns)), method="cubic")
    return lambda place: float(np.exp(np.ravel(logs(place))[0]))
