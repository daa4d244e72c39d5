"""What goes wrong while a bench is set up: each is said in a sentence, and nothing is lost."""

import numpy as np
import pytest

import fe
from rig.calibration.board import CharucoBoard
from rig.calibration.board_guides import LensGuide, PoseGuide
from rig.calibration.guide import Progress
from rig.calibration.latency import Latency
from rig.calibration.lens import Lens
from rig.calibration.light_guides import StripesGuide
from rig.live.snapshot import Mark
from rig.projector.content import Plain, Stripe
from rig.projector.markers import fit_plate
from rig.projector.outputs import Output
from rig.setup import guided_steps
from rig.setup.answers import Answers
from rig.setup.bench import NOTHING, CameraChoice, PersonAct
from rig.setup.choose_camera import choose_camera, figures_of, signs_of
from rig.setup.choose_projector import choose_projector
from rig.setup.desk import Answer, Leave, Next, Push
from rig.setup.free_plate import in_the_way
from rig.setup.guided_steps import be_guided
from rig.setup.rehearsal import RehearsedBench
from rig.setup.scene_file import board_for, scene_of
from rig.setup.session import SetupSession, read_state, state_beside
from rig.setup.steps import STEPS
from rig.setup.true_bench import LAPTOP, PROJECTOR
from rig.setup.weight_guide import WeightGuide, targets
from rig.system.frame import Frame
from synthetic import Distortion

STEP = {step.name: step for step in STEPS}
LENS = Lens((640, 480), 900.0, (320.0, 240.0), Distortion(), 0.0, 0.0, 0.0, ())


def board_in_mirror():
    drawn = np.asarray(CharucoBoard().draw(2.5))
    image = np.full((480, 640), 120, np.uint8)
    image[30 : 30 + drawn.shape[0], 40 : 40 + drawn.shape[1]] = drawn
    return np.ascontiguousarray(image[:, ::-1])


@pytest.mark.parametrize(
    "guide", [LensGuide(CharucoBoard()), PoseGuide(LENS, CharucoBoard(), (0.0, 160.0), 1.0)]
)
def test_a_board_in_a_mirror_is_named_and_not_taken(guide):
    for number in range(3):
        guide.add_frame(Frame(number, number / 30, board_in_mirror()))
    assert guide.progress.sentence.startswith("the board is seen in a mirror")
    assert guide.progress.taken == 0
    guide.add_frame(Frame(9, 1.0, np.ascontiguousarray(board_in_mirror()[:, ::-1])))
    assert "mirror" not in guide.progress.sentence


class Weight:
    """Frames of a weight that lies, is lifted, and lies elsewhere, 20 a second."""

    def __init__(self, guide):
        self.guide, self.number = guide, 0

    def lies(self, x, y, seconds=3.0, force=2.0):
        for _ in range(round(20 * seconds)):
            self.number += 1
            image = np.full((6, 8), self.number % 250, np.uint8)
            found = () if force == 0 else (Mark(x, y, force, (0.5, 0.4, 0.0), 0.02),)
            self.guide.add_frame(Frame(self.number, self.number / 20, image), found)


def test_a_press_beside_the_mark_is_named_and_not_taken():
    guide = WeightGuide(targets((254.0, 203.0), 2.0))
    weight, (first, second) = Weight(guide), guide.targets[:2]
    weight.lies(first.x + 30, first.y - 40)
    assert guide.progress.taken == 0
    assert guide.progress.sentence.startswith("that press is 50 mm beside the mark; lift it")
    weight.lies(0, 0, 0.3, force=0)
    assert guide.progress.sentence.startswith("lay the weight on the mark at")
    weight.lies(first.x + 3, first.y)
    assert guide.progress.taken == 1
    assert guide.progress.sentence == "take the weight off the plate"
    weight.lies(second.x, second.y)  # it was pushed there, and not lifted
    assert guide.progress.taken == 1
    weight.lies(0, 0, 0.3, force=0)
    weight.lies(second.x, second.y)
    assert [taken[0] for taken in guide.taken] == [first, second]


def test_the_image_of_a_press_is_the_mean_of_the_frames_in_which_it_lay_still():
    guide = WeightGuide((fe.Touch(100.0, 80.0, 2.0),))
    weight = Weight(guide)
    weight.lies(100, 80)
    _, frames, image = guide.taken[0]
    last = 1 + round((0.6 + 2.0) * 20)  # it must stand still first
    assert frames == pytest.approx((2.0 - 0.4) * 20, abs=1)  # and the light of its mark be gone
    assert image.mean() == pytest.approx(last - (frames - 1) / 2, abs=1)


def test_a_weight_that_is_lifted_too_early_is_laid_again():
    guide = WeightGuide((fe.Touch(100.0, 80.0, 2.0),))
    weight = Weight(guide)
    assert guide.mark == guide.target
    weight.lies(100, 80, 1.0)
    assert guide.progress.sentence == "leave it there"
    assert guide.mark is None
    weight.lies(0, 0, 0.2, force=0)
    assert guide.progress.taken == 0
    weight.lies(100, 80)
    assert guide.progress.taken == 1


class Bench(RehearsedBench):
    """A rehearsal whose outputs and camera come and go."""

    def __init__(self, size=(384, 480)):
        super().__init__(3)
        self.size, self.opened = size, 0

    def cameras(self):
        return CameraChoice("/dev/video0", "one"), CameraChoice("/dev/video2", "two")

    def next_frame(self, timeout, interval):
        self._now += interval
        return Frame(1, self._now, np.full(self.size, 90, np.uint8))


def session(tmp_path, desk, acts, bench, *done, **answers):
    path = tmp_path / "my.toml"
    desk.begin(path, done, **answers)
    person = desk.Person(acts)
    return SetupSession(path, bench, person, read_state(state_beside(path))), person


def test_an_output_that_vanishes_before_it_is_chosen_is_said(tmp_path, desk):
    bench = Bench()
    wishes = iter(["gone", "leave"])

    def acts(view):
        match next(wishes):
            case "gone":
                assert "did this screen flash?" in view.sentence
                bench.screens = (LAPTOP,)
                return Push("next")
            case _:
                return Leave()

    setup, person = session(tmp_path, desk, acts, bench, "plate", "print", "camera")
    assert choose_projector(setup, STEP["output"]) == Leave()
    assert bench.flashed == [PROJECTOR]
    assert any(said.endswith("plug it in again, or choose another") for said in person.said)
    assert setup.state.answers.output is None


@pytest.mark.parametrize(
    ("screens", "text", "kept"),
    [
        ((LAPTOP, PROJECTOR), str(PROJECTOR), "HDMI-1"),
        ((LAPTOP, PROJECTOR), str(LAPTOP), "eDP-1"),
        ((LAPTOP, Output(1, "eDP-1", (800, 600), (1366, 0))), None, 1),
        ((Output(0, "", (800, 600), None),), None, 0),
    ],
)
def test_an_output_is_kept_by_name_where_that_is_its_own(tmp_path, desk, screens, text, kept):
    bench = Bench()
    bench.screens = screens
    wishes = iter([Answer("output", text)] * (text is not None) + [Push("next")])
    given = lambda view: next(wishes)  # noqa: E731
    setup, _ = session(tmp_path, desk, given, bench, "plate", "print", "camera")
    assert choose_projector(setup, STEP["output"]) == Next()
    assert setup.state.answers.output == kept
    assert setup.scene.projector.output == kept
    assert setup.scene.projector.size == bench.flashed[-1].size


def test_nothing_is_taken_that_did_not_flash(tmp_path, desk):
    class Dark(Bench):
        def flash(self, output):
            raise OSError("the desktop has gone; log in to it again")

    wishes = iter([Push("next"), Push("flash"), Push("next"), Leave()])
    given = lambda view: next(wishes)  # noqa: E731
    setup, person = session(tmp_path, desk, given, Dark(), "plate", "print", "camera")
    assert choose_projector(setup, STEP["output"]) == Leave()
    assert "the desktop has gone; log in to it again" in person.said


class Flashes:
    """A guide that has its result at once."""

    progress, shows = Progress("leave the plate alone", 0, 1), ()

    def __init__(self, delay):
        self.delay = delay

    def add_frame(self, frame):
        pass

    def result(self):
        return Latency(self.delay, self.delay, 0.001, 15, 0)


@pytest.mark.parametrize(("delay", "needed"), [(0.04, 0), (0.4, 1)])
def test_a_step_goes_on_by_itself_where_what_it_found_is_good(
    tmp_path, desk, monkeypatch, delay, needed
):
    monkeypatch.setattr(guided_steps, "guide_for", lambda setup, name: Flashes(delay))
    pushed = []

    def acts(view):
        if any(one.name == "next" for one in view.buttons):
            assert "switch off what the projector does to images" in view.trouble
            pushed.append("next")
            return Push("next")
        return None

    done = "plate", "print", "camera", "output"
    setup, _ = session(tmp_path, desk, acts, Bench(), *done, output="HDMI-1")
    assert be_guided(setup, STEP["latency"]) == Next()
    assert len(pushed) == needed
    assert setup.calibration.latency.median == delay


def test_a_plate_is_free_once_board_and_hands_are_gone(rng):
    speckle = np.kron(rng.integers(60, 180, (96, 128)), np.ones((5, 5)))
    drawn = CharucoBoard().draw(2.5)
    covered = speckle.copy()
    covered[30 : 30 + drawn.shape[0], 40 : 40 + drawn.shape[1]] = drawn
    handed = [speckle.copy() for _ in range(16)]
    for number, image in enumerate(handed):
        image[:, 4 * number : 4 * number + 60] = 90

    def seen(images):
        noisy = (image + rng.normal(0, 1, image.shape) for image in images)
        frames = [np.clip(image, 0, 255).astype(np.uint8) for image in noisy]
        return in_the_way(frames, CharucoBoard())

    assert seen([speckle] * 16) == ""
    assert seen([covered] * 16) == "the board is still in view; take it away"
    assert seen(handed) == "something moves in the image; take your hands off the plate"


def test_an_output_that_vanishes_under_the_stripes_begins_them_anew(tmp_path, desk, monkeypatch):
    bench, shown = Bench(), []
    guide = StripesGuide(None, None, PROJECTOR.size)
    monkeypatch.setattr(guided_steps, "guide_for", lambda setup, name: guide)

    def acts(view):
        if view.progress is not None:
            shown.append(view.progress.taken)
            if shown[-1] == 4 and len(bench.screens) == 2:
                bench.screens = (LAPTOP,)
            elif "gone" in view.trouble and shown[-1] == 0:
                bench.screens = (LAPTOP, PROJECTOR)
            elif max(shown) > 4:
                return Leave()
        return None

    setup, person = session(
        tmp_path, desk, acts, bench, "plate", "print", "camera", "output", output="HDMI-1"
    )
    assert be_guided(setup, STEP["projector"]) == Leave()
    first = shown.index(4)
    assert shown[first + 1] == 0
    assert any("HDMI-1' is not there any more" in said for said in person.said)


def test_a_camera_of_other_pixels_is_not_taken(tmp_path, desk):
    wishes = iter([None, Push("next"), Leave()])
    given = lambda view: next(wishes)  # noqa: E731
    setup, person = session(tmp_path, desk, given, Bench((300, 400)), "plate", "print")
    assert choose_camera(setup, STEP["camera"]) == Leave()
    assert (
        "camera gives 400 x 300 px, and 480 x 384 were said of it; set its pixels to 400 x 300 in"
        " the step 'Plate'" in person.said
    )


def test_a_camera_is_chosen_by_what_it_is_called(tmp_path, desk):
    wishes = iter([Answer("camera", "/dev/video2, two"), None, Push("next")])
    given = lambda view: next(wishes)  # noqa: E731
    setup, person = session(tmp_path, desk, given, Bench(), "plate", "print")
    assert choose_camera(setup, STEP["camera"]) == Next()
    assert setup.state.answers.camera == "/dev/video2"
    assert person.view.questions[0].value == "/dev/video2, two"


def test_a_camera_that_does_not_open_is_said_and_another_can_be_taken(tmp_path, desk):
    class Busy(Bench):
        def open_source(self, scene):
            raise OSError("camera '/dev/video0' is in use; close that program")

    wishes = iter([None, Leave()])
    setup, person = session(tmp_path, desk, lambda view: next(wishes), Busy(), "plate", "print")
    assert choose_camera(setup, STEP["camera"]) == Leave()
    assert "camera '/dev/video0' is in use; close that program" in person.said


def test_figures_of_a_camera_warn_of_light_and_focus():
    rng = np.random.default_rng(1)
    sharp = np.kron(rng.integers(0, 2, (60, 80)), np.ones((4, 4))) * 150 + 40
    blurred = sum(np.roll(sharp, (i, j), (0, 1)) for i in range(5) for j in range(5)) / 25
    good, soft = (figures_of(image.astype(np.uint8)) for image in (sharp, blurred))
    assert sum(good.histogram) == sharp.size
    assert not any(sign.warns for sign in signs_of(good, good.focus))
    assert [sign.name for sign in signs_of(soft, good.focus) if sign.warns] == ["focus"]
    bright = figures_of(np.clip(sharp * 2, 0, 255).astype(np.uint8))
    assert "shorten the exposure" in signs_of(bright, bright.focus)[0].says
    dark = figures_of((sharp / 3).astype(np.uint8))
    assert "more light" in signs_of(dark, dark.focus)[0].says


def test_the_twin_does_what_is_asked_and_nothing_else(desk):
    said = Answers.model_validate(desk.small | {"output": "HDMI-1"})
    bench = RehearsedBench(2)
    truth = bench.prepare(said)
    named = said.model_copy(update={"camera": "/dev/video0", "output": None})
    assert bench.prepare(named) is truth  # what it is called changes nothing of it
    scene, board = scene_of(said, rehearsal=True), board_for(said)
    with bench.open_source(scene) as source:

        def mean(act, content=None, light=None):
            bench.ask(act)
            if light:
                light(content)
            return [source.grab(1.0) for _ in range(8)][-1].image

        rest = mean(NOTHING).astype(float)
        assert board.find(mean(PersonAct("hold board"))) is not None
        assert board.find(mean(PersonAct("lay board"))) is not None
        noise = (mean(NOTHING) - rest).std()
        assert noise < 4
        pressed = mean(PersonAct("press", fe.Touch(120.0, 100.0, 30.0)))
        assert (pressed - rest).std() > 1.5 * noise
        screen = fit_plate(PROJECTOR.size, said.size)
        with bench.open_light(scene, screen) as light:
            assert mean(NOTHING, Plain(255), light).mean() > rest.mean() + 15
            striped = mean(NOTHING, Stripe(2), light).mean()
            assert rest.mean() + 2 < striped < rest.mean() + 40
            assert mean(NOTHING, Plain(0), light).mean() == pytest.approx(rest.mean(), abs=1)
