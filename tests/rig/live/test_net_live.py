"""A trained net in the live loop: trained as the command does, run in the twin, replayed."""

import subprocess
import sys
from copy import deepcopy

import numpy as np
import pytest

from models.nets import store
from rig.live.baseline import ReferenceFrame, average_reference
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.live.net_chain import plan_net
from rig.live.tracker import FrameProcessor
from rig.recording.recorder import SessionRecorder
from rig.recording.replay import replay
from rig.recording.session import open_session
from rig.scene.theory import choose
from rig.sources.twin import build_twin
from rig.system.frame import Frame
from rig.system.timing import Stopwatch
from rig.training.data import simulate_sets
from rig.training.descend import descend
from rig.training.model_score import score_model
from rig.training.plan import training_plan

NET = {
    "kind": "net",
    "layers": [48],
    "activation": "silu",
    "inputs": "relative",
    "outputs": "scaled",
    "epochs": 500,
    "learning_rate": 0.01,
    "decay": "cosine",
    "batch": 256,
}
SCENE = {
    "touches.max_touches": 1,
    "touches.force": [2.0, 8.0],
    "gauges": {"kind": "lattice", "spacing": 25.5, "margin": 25.0, "subset": 41},
    "training": {
        "samples": 3000,
        "force": [2.0, 8.0],
        "margin": 30.0,
        "test_samples": 300,
        "rendered_images": 8,
    },
    "source.script": "random",
}


def quiet(done, total):
    """Report of progress that nobody reads."""


@pytest.fixture(scope="session")
def model(tmp_path_factory):
    """Path of the model that the tests share; the first of them trains it."""
    return tmp_path_factory.mktemp("model") / "model.h5"


@pytest.fixture
def netted(small, model):
    """Load the small twin with a net, trained once: `netted({"estimator.solver_steps": 2})`."""

    def make(overrides=()):
        named = SCENE | {"estimator": NET | {"model": str(model)}}
        scene = small(deepcopy(named) | dict(overrides))
        if not model.exists():
            plan = training_plan(small(named))
            trained = descend(plan, simulate_sets(plan, quiet), plan.descent.layers)
            store.save_net(model, trained, {"scene": small(named).model_dump(mode="json")})
        return scene

    return make


def run(scene, in_hand, sequences, **options):
    """Run the loop in hand on frames of the twin; give the loop and its snapshots."""
    source = in_hand(build_twin(scene), [*range(16), *sequences])
    loop = Loop(build_bench(scene, quiet), source, **options)
    return loop, list(loop)


@pytest.mark.slow
def test_net_strain_and_pattern_are_scored_in_one_run(netted, in_hand):
    """Medians measured: net 6.7 mm, with two steps 4.0, strain map 2.1, whole pattern 1.3."""
    medians = {}
    for steps in (0, 2):
        loop, shots = run(netted({"estimator.solver_steps": steps}), in_hand, range(40, 400, 6))
        said = loop.summary()
        assert said["net"]["frames"] == said["pattern"]["frames"] == said["strain"]["frames"] == 60
        assert said["net"]["false_touches"] == 0
        medians[steps] = said["net"]["position_median_mm"]
        assert said["pattern"]["position_median_mm"] < medians[steps] < 12.0
        pressed = [shot for shot in shots if shot.touches]
        assert len(pressed) > 20
        assert all(shot.touches[0].sigma[0] > 0.1 for shot in pressed)  # mm
    assert medians[2] < medians[0]


@pytest.mark.slow
def test_the_score_of_a_net_that_a_camera_feeds_says_how_sure_it_is(netted, model):
    """Measured: 10 of 300 touches missed, rms 12 mm, bound 6.5 mm, inside one sigma 0.71."""
    netted()
    total = score_model(model, quiet).touches
    assert (total.touches, total.false) == (300, 0)
    assert total.misses < 20
    assert 0.0 < total.bound < total.rms < 15.0
    np.testing.assert_allclose(total.inside, (0.683, 0.954, 0.997), atol=0.06)


def test_a_net_tells_touches_of_a_camera_that_knows_no_truth(netted, in_hand):
    twin = build_twin(netted())
    scene = netted({"source": {"kind": "opencv"}, "comparison": None})
    source = in_hand(twin, [*range(16), *range(60, 90, 3)], with_truth=False)
    loop = Loop(build_bench(scene, quiet), source)
    shots = list(loop)
    assert sum(len(shot.touches) for shot in shots) > 3
    assert all(shot.truth is None for shot in shots)
    said = loop.summary()
    assert (said["net"]["frames"], said["strain"]) == (0, None)


@pytest.mark.slow
def test_what_the_net_tells_is_followed_and_replayed_bit_for_bit(netted, in_hand, tmp_path):
    scene, path = netted(), tmp_path / "session.h5"
    with SessionRecorder(path, {"scene": scene.model_dump_json()}) as recorder:
        _, shots = run(scene, in_hand, range(60, 90, 3), recorder=recorder)
    assert any(mark.identity is not None for shot in shots for mark in shot.touches)
    with open_session(path) as session:
        again = list(replay(session, build_bench(session.scene, quiet), Stopwatch(lambda: 0.0)))
    assert [one.same for one in again] == [True] * 10


@pytest.mark.slow
def test_nothing_is_reported_on_an_untouched_plate_or_behind_a_hand(netted, in_hand):
    scene = netted({"source.script": "empty"})
    _, shots = run(scene, in_hand, range(20, 40))
    assert all(shot.touches == () for shot in shots)
    twin = build_twin(scene)
    zero = average_reference([twin.frame(k, ()) for k in range(16)])
    follower = FrameProcessor(build_bench(scene, quiet), zero, Stopwatch(lambda: 0.0), lambda: 0.0)
    image = twin.frame(50, ()).copy()
    image[100:180, 150:260] = 0
    assert follower.process(Frame(0, 0.0, image, None)).frame_estimate.estimate.count == 0


@pytest.mark.slow
def test_a_net_needs_no_torch_live(netted):
    scene = netted()
    code = (
        "import sys; from rig.scene import Scene; from rig.live.bench import build_bench;"
        f"build_bench(Scene.model_validate_json({scene.model_dump_json()!r}), lambda d, t: None);"
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.slow
def test_a_scene_without_a_net_imports_none(small):
    code = (
        "import sys; from rig.scene import Scene; from rig.live.bench import build_bench;"
        f"build_bench(Scene.model_validate_json({small().model_dump_json()!r}), lambda d, t: None);"
        "sys.exit('rig.live.net_chain' in sys.modules or 'models.nets.net' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"touches.max_touches": 2},
            "expects up to 2 touches, and its net tells one; set touches.max_touches",
        ),
        ({"gauges.spacing": 51.0}, r"was trained for another \[gauges\] than scene"),
        ({"plate.young": 2000.0}, r"was trained for another \[plate\] than scene"),
        ({"plate.theory": "large"}, "nets learn the linear one; expect smaller forces, or set"),
        ({"estimator.model": "none.h5"}, "model file none.h5 does not exist; train the model"),
        ({"gauges.subset": None}, "set gauges.subset, by which DIC reads the gauges, and"),
    ],
)
def test_a_net_that_does_not_suit_is_refused_by_what_differs(netted, changes, sentence):
    scene = netted(changes)
    with pytest.raises((ValueError, OSError), match=sentence):
        plan_net(scene, choose(scene, scene.plate, None))


def test_gauges_that_stand_off_the_pattern_are_said(netted):
    scene = netted()
    bench, twin = build_bench(scene, quiet), build_twin(scene)
    image = np.mean([twin.frame(k, ()) for k in range(4)], axis=0).astype(np.float32)
    chain, _ = bench.prepare(ReferenceFrame(image, 2.0))
    blank = image.copy()
    blank[:, :150] = 120.0
    with pytest.raises(ValueError, match=r"of 63 gauges show no pattern to follow; look after"):
        bench.prepare_net(ReferenceFrame(blank, 2.0), chain)
