"""The guided calibrations, fed frame by frame as a live source does."""

from datetime import UTC, datetime

import numpy as np
import pytest

import synthetic
from rig.calibration.board import CharucoBoard
from rig.calibration.board_guides import LensGuide, PoseGuide
from rig.calibration.entries import LatencyEntry
from rig.calibration.guided import lead
from rig.calibration.latency import Latency
from rig.calibration.lens import Lens
from rig.calibration.light_guides import LatencyGuide, StripesGuide, settling_of
from rig.calibration.noise_guide import NoiseGuide
from rig.projector import gray_code
from rig.projector.content import Plain, Stripe, draw
from rig.projector.markers import fit_plate, project
from rig.scene.plate import PlateSection
from rig.system.frame import Frame

BOARD = CharucoBoard((11, 9), 20.0, 15.0)
PLATE = PlateSection.model_validate({
    "size": (254, 203), "thickness": 2, "young": 3000, "poisson": 0.38,
    "edges": {"kind": "clamped"},
})  # fmt: skip
STANDS = [(127, 100, 430), (330, 100, 380), (-90, 120, 370), (127, 320, 360), (130, -130, 380)]


class Images:
    """A source that gives images in turn, 30 a second of its own time."""

    status = "the images are at their end"

    def __init__(self, images):
        self._images = iter(images)
        self.number = 0

    def grab(self, timeout):
        image = next(self._images, None)
        if image is None:
            raise EOFError(self.status)
        self.number += 1
        return Frame(self.number, self.number / 30, image)


def nobody():
    return ()


def quiet(*words):
    pass


def board_image(room, camera, rng, sharp=[]):  # noqa: B006  (drawn once)
    if not sharp:
        sharp.append(40 + BOARD.draw(6.0) * (170 / 255))
    mm = (room.places_seen(camera, 1.0) - (10.0, 190.0)) * (1.0, -1.0)
    return room.photograph(room.look_up(sharp[0], 6.0 * mm - 0.5).mean(axis=2), rng)


@pytest.fixture(scope="module")
def views(room):
    """Give each of five views of the board, twice in other noise: it is held still."""
    rng = np.random.default_rng(4)
    images = [board_image(room, room.camera_at(stand), rng) for stand in STANDS]
    noise = [rng.normal(0, 1, image.shape) for image in images]
    return [
        np.clip(image + sign * part, 0, 255).astype(np.uint8)
        for image, part in zip(images, noise, strict=True)
        for sign in (1, -1)
    ]


def test_the_lens_guide_takes_each_view_that_stands_still_and_is_new(room, views):
    reported = []
    guide = LensGuide(BOARD, wanted=5)
    blank = np.full(views[0].shape, 90, np.uint8)
    lens = lead(guide, Images([blank, *views]), quiet, lambda now, _: reported.append(now), nobody)
    assert [now.taken for now in reported] == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5]
    assert reported[0].sentence == "hold the whole board before the camera"
    assert reported[1].sentence == "hold the board still"
    assert reported[2].sentence == "taken; now tilt the board to another side"
    assert lens.focal == pytest.approx(room.focal, rel=0.01)
    assert lens.error < 0.1  # mm
    assert reported[-1].error == lens.error


def test_a_view_that_is_dropped_is_asked_for_again(views):
    guide = LensGuide(BOARD, wanted=4)
    source = Images(views)
    drops = iter([(), (), (), (), (), (0,)])
    lead(guide, source, quiet, quiet, lambda: next(drops, ()))
    assert [name for name, _ in guide.progress.views] == [1, 2, 3, 4]
    assert source.number == 10


@pytest.mark.parametrize("first", [0, 50])
def test_a_board_is_found_by_its_own_markers_and_no_others(first):
    shown, other = CharucoBoard(first=first), CharucoBoard(first=94 if first else 50)
    image = np.full((560, 700), 120, np.uint8)
    drawn = shown.draw(3.0)
    image[40 : 40 + drawn.shape[0], 20 : 20 + drawn.shape[1]] = drawn
    view = shown.find(image)
    assert len(view.mm) == 70
    assert np.abs(view.px - (3.0 * view.mm + (19.5, 39.5))).max() < 0.2  # px
    assert other.find(image) is None


def test_the_same_view_is_not_taken_twice(views):
    guide = LensGuide(BOARD)
    for number in range(8):
        guide.add_frame(Frame(number, 0.0, views[number % 2]))
    assert guide.progress.taken == 1
    assert guide.progress.sentence.startswith("now tilt the board")


def test_the_pose_guide_finds_the_plate_to_0_15_mm_and_says_so(room):
    rng = np.random.default_rng(5)
    camera = room.camera_at((127.0, 101.0, 460.0), (127.0, 101.0, 0.0))
    lens = Lens(room.size, room.focal, room.centre, room.lens, 0.0, 0.0, 0.0, ())
    images = [board_image(room, camera, rng) for _ in range(4)]
    guide = PoseGuide(lens, BOARD, (10.0, 190.0), 1.0, wanted=4)
    pose = lead(guide, Images(images), quiet, quiet, nobody)
    grid = np.stack(np.meshgrid([5.0, 127.0, 249.0], [5.0, 100.0, 198.0]), -1).reshape(-1, 2)
    px = camera.project(np.column_stack([grid, np.ones(len(grid))]))
    away = np.linalg.norm(pose.camera.on_plate(px, 1.0) - grid, axis=1)
    assert away.max() < 0.15  # mm
    assert np.sqrt(np.mean(away**2)) < 4 * pose.error


def test_a_bumped_board_begins_the_series_anew(room):
    rng = np.random.default_rng(6)
    lens = Lens(room.size, room.focal, room.centre, room.lens, 0.0, 0.0, 0.0, ())
    guide = PoseGuide(lens, BOARD, (10.0, 190.0), 1.0)
    for number, x in enumerate((127, 127, 135)):
        camera = room.camera_at((x, 100, 460), (x, 100, 0))
        guide.add_frame(Frame(number, 0.0, board_image(room, camera, rng)))
    assert guide.progress.taken == 1
    assert guide.progress.sentence == "leave the board alone"


class Lit:
    """A plate before a camera, lit by what a window shows, some frames later."""

    status = "it is dark"
    size = (160, 100)

    def __init__(self, room, delay=2):
        self.screen = fit_plate(self.size, (254.0, 203.0))
        self.camera = room.camera_at((127.0, 101.0, 460.0), (127.0, 101.0, 0.0))
        places = room.places_seen(self.camera, 1.0)
        self.px = project(self.screen.T_px_plate, places.reshape(-1, 2)).reshape(places.shape)
        inside = ((places >= 0) & (places <= (254.0, 203.0))).all(axis=-1)
        self.rng = np.random.default_rng(2)
        self.grain = self.rng.uniform(0.4, 1.0, places.shape[:2])[..., None] * inside
        self.room, self.shown, self.seen, self.number = room, [Plain(0)] * delay, {}, 0

    def show(self, content):
        self.content = content

    def grab(self, timeout):
        self.shown.append(self.content)
        now = self.shown.pop(0)
        if now not in self.seen:
            image = draw(now, self.screen)[..., 0]
            light = 20 + 0.5 * self.room.look_up(image, self.px)
            self.seen[now] = (30 + self.grain * light).mean(axis=2)
        self.number += 1
        return Frame(self.number, self.number / 30, self.room.photograph(self.seen[now], self.rng))


@pytest.fixture(scope="module")
def lit(room):
    """Calibrate a projector that the camera sees two frames late."""
    bench = Lit(room)
    guide = StripesGuide(bench.camera, PLATE, bench.size)
    reported = []
    return (
        bench,
        lead(guide, bench, bench.show, lambda now, _: reported.append(now), nobody),
        reported,
    )


@pytest.mark.slow
def test_the_stripes_guide_finds_the_projector_to_0_3_mm(lit):
    bench, light, reported = lit
    grid = np.stack(np.meshgrid(np.linspace(5, 249, 8), np.linspace(5, 198, 8)), -1).reshape(-1, 2)
    shown = project(light.screen.T_px_plate, grid)
    away = np.linalg.norm(project(np.linalg.inv(bench.screen.T_px_plate), shown) - grid, axis=1)
    assert away.max() < 0.3  # mm; a pixel of this projector is 1.8 mm
    assert light.error < 0.3
    assert reported[-1].taken == reported[-1].wanted == gray_code.count(bench.size)


@pytest.mark.slow
def test_the_stripes_guide_measures_how_bright_the_projector_is(lit):
    _, light, _ = lit
    assert light.strength == pytest.approx(0.5 * 255 / 20, rel=0.05)
    assert light.black == pytest.approx(30, abs=2)


def delay(median, p95):
    return LatencyEntry(error=0.0, date=datetime.now(UTC), median=median, p95=p95)


@pytest.mark.slow
def test_stripes_come_as_fast_as_the_delay_that_was_measured_allows(lit, room):
    slow, _, _ = lit
    bench, late = Lit(room), delay(0.08, 0.1)
    guide = StripesGuide(bench.camera, PLATE, bench.size, settling_of(late))
    light = lead(guide, bench, bench.show, quiet, nobody)
    assert bench.number < 0.7 * slow.number
    grid = np.array([[5.0, 5.0], [249.0, 198.0], [5.0, 198.0], [127.0, 100.0]])
    shown = project(light.screen.T_px_plate, grid)
    away = np.linalg.norm(project(np.linalg.inv(bench.screen.T_px_plate), shown) - grid, axis=1)
    assert away.max() < 0.3  # mm


def test_a_projector_whose_delay_is_not_known_or_long_is_waited_for_as_long():
    late = delay(0.4, 0.5)
    assert settling_of(None) == settling_of(late) == 0.5


def test_the_stripes_guide_asks_for_one_stripe_after_the_other(room):
    guide = StripesGuide(None, None, (160, 100))
    for number in range(3):
        assert guide.shows == Stripe(number)
        for k in range(20):
            guide.add_frame(Frame(k, 1.0 * number + k / 30, np.zeros((4, 4), np.uint8)))
    guide.drop(0)
    assert guide.shows == Stripe(0)


def test_the_latency_guide_flashes_and_finds_the_delay(rng):
    now, delay, light = 100.0, 0.05, []
    guide = LatencyGuide(rng, lambda: now)
    number, result = 0, None
    while (result := guide.result()) is None:
        now += 0.004
        light.append((now, guide.shows))
        if now > 100 + number / 30:
            number += 1
            before = [one for time, one in light if time <= now - delay]
            level = 40 + (60 if before and before[-1] == Plain(255) else 0)
            image = np.clip(rng.normal(level, 1.0, (24, 32)), 0, 255).astype(np.uint8)
            guide.add_frame(Frame(number, now, image))
    assert isinstance(result, Latency)
    assert result.median == pytest.approx(delay + 0.5 / 30, abs=4 * result.sigma)
    assert (result.flashes, result.missed) == (15, 0)


def test_the_noise_guide_asks_for_other_light_until_it_has_three(rng):
    sensor = synthetic.Sensor(noise=1.5, black=0.0, white=1.0, full_well=9000.0)
    texture = rng.uniform(0.3, 1.0, (120, 160))
    levels = [0.4] * 16 + [0.15] * 14 + [0.8] * 14
    reported = []
    images = Images(sensor.capture(level * texture, rng) for level in levels)
    found = lead(NoiseGuide(), images, quiet, lambda now, _: reported.append(now.sentence), nobody)
    assert "change the light or the exposure by a third, then wait" in reported
    assert found.gain == pytest.approx(255 / 9000, rel=0.08)


def test_a_source_that_ends_or_falls_silent_is_one_sentence(views, monkeypatch):
    with pytest.raises(ValueError, match="at their end; the calibration needs more images"):
        lead(LensGuide(BOARD), Images(views[:2]), quiet, quiet, nobody)
    monkeypatch.setattr("rig.calibration.guided.PATIENCE", 0.01)

    class Silent:
        status = "/dev/video0 was unplugged"

        def grab(self, timeout):
            return None

    with pytest.raises(OSError, match=r"no frame came for 0\.01 s; /dev/video0 was unplugged"):
        lead(LensGuide(BOARD), Silent(), quiet, quiet, nobody)
