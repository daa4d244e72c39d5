"""The bench that a run builds: what the scene says, what `show` says, and no more."""

import numpy as np
import pytest

import rig
from dic import lay_tiles
from fe.linear.energy import stiffness
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.scene.account import account
from rig.sources.twin import build_twin
from rig.system.cache import CacheWarning


def quiet(done, total):
    """Report of progress that nobody reads."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"plate.size": [254, 127], "camera.pixels": [400, 240], "dic.subset": 49},
        {
            "plate.size": [300, 11],
            "plate.thickness": 0.5,
            "camera.pixels": [420, 300],
            "estimator.modes": 20,
        },
    ],
)
def test_what_is_shown_is_what_is_built(small, changes):
    scene = small(changes)
    bench, twin = build_bench(scene, quiet), build_twin(scene)
    said = {part.name: f"{part.what} {part.cost}" for part in account(scene).parts}
    columns, rows = bench.motions.modes.mesh.counts
    unknowns = stiffness(bench.plate, bench.motions.modes.mesh).shape[0]
    assert f"{columns} × {rows} elements, {unknowns} unknowns" in said["plate"]
    assert "{} × {} elements solved".format(*twin.solver.mesh.counts) in said["source"]
    tiles = bench.motions.tiles
    assert f"tiles of {tiles.size} px; reference of {bench.reference_frames} " in said["dic"]
    assert f"{len(tiles.xy)} tiles a frame" in said["dic"]
    assert f"{len(bench.motions.modes.stiffness)} modes" in said["estimator"]
    assert "{} × {} px".format(*bench.camera.size) in said["camera"]
    block, window = bench.dic.block, bench.dic.window
    assert f"blocks of {block} × {block} tiles" in said["comparison"]
    assert f"windows of {window} × {window} blocks" in said["comparison"]
    assert f"strain at {len(tiles.xy)} places" in said["comparison"]


def test_the_shipped_twin_is_built_as_it_is_shown():
    scene = rig.load("twin")
    assert scene.plate is not None
    assert scene.camera is not None
    assert scene.dic is not None
    said = {part.name: f"{part.what} {part.cost}" for part in account(scene).parts}
    tiles = lay_tiles(scene.camera.pixels[::-1], scene.dic.tile)
    assert f"{len(tiles.xy)} tiles a frame" in said["dic"]
    assert f"{tiles.size} px" in said["dic"]
    assert "200 modes" in said["estimator"]


def test_without_a_comparison_no_strain_is_prepared(small):
    scene = small().model_copy(update={"comparison": None})
    bench, twin = build_bench(scene, quiet), build_twin(scene)
    chain, strain = bench.prepare(average_reference([twin.frame(k, ()) for k in range(2)]))
    assert strain is None
    assert chain.estimator.max_touches == 2
    said = account(scene)
    assert "comparison" not in {part.name for part in said.parts}
    assert {"strain map", "comparison"} <= {part.name for part in said.left_out}


def test_the_parts_are_those_of_the_scene(small):
    bench = build_bench(small({"touches.max_touches": 3, "touches.force": ["0.7 N", "2 N"]}), quiet)
    assert bench.plate.size == (254.0, 203.0)
    assert bench.camera.size == (384, 320)
    assert (bench.height, bench.max_touches, bench.min_force) == (1.0, 3, 0.7)


def test_a_second_start_computes_nothing(small, tmp_path, monkeypatch):
    scene = small()
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(tmp_path))
    reports = []
    first = build_bench(scene, lambda done, total: reports.append((done, total)))
    assert reports
    stored = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")}
    second = build_bench(scene, lambda done, total: pytest.fail("computed again"))
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.npz")} == stored
    np.testing.assert_array_equal(first.motions.modes.values, second.motions.modes.values)


def test_damaged_modes_are_computed_again(small, tmp_path, monkeypatch):
    scene = small()
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(tmp_path))
    build_bench(scene, quiet)
    (stored,) = tmp_path.glob("modes/*.npz")
    stored.write_bytes(stored.read_bytes()[:-100])
    with pytest.warns(CacheWarning, match=f"{stored.name} was damaged and is computed again"):
        build_bench(scene, quiet)


@pytest.mark.parametrize("section", ["plate", "camera", "dic", "estimator"])
def test_a_scene_that_lacks_a_part_is_refused(small, section):
    scene = small().model_copy(update={section: None})
    with pytest.raises(ValueError, match=r"cannot run live; it needs \[plate\], \[camera\]"):
        build_bench(scene, quiet)


def test_an_estimator_that_cannot_run_live_is_refused(small):
    for section, sentence in (
        ("estimator", "cannot run its net live"),
        ("comparison", "only strain"),
    ):
        scene = small()
        net = rig.load("paper-one").estimator
        with pytest.raises(ValueError, match=sentence):
            build_bench(scene.model_copy(update={section: net}), quiet)


def test_too_few_tiles_for_the_modes_are_one_sentence(small):
    bench = build_bench(small({"dic.tile": 32, "estimator.modes": 200}), quiet)
    twin = build_twin(small())
    zero = average_reference([twin.frame(k, ()) for k in range(2)])
    with pytest.raises(ValueError, match=r"384 × 320 px cannot tell 200 modes .*dic\.tile lower"):
        bench.prepare(zero)


def test_a_blank_image_is_one_sentence(small):
    bench = build_bench(small(), quiet)
    with pytest.raises(ValueError, match=r"reference image is blank .* it needs a pattern"):
        bench.prepare(average_reference([np.full((320, 384), 90, np.uint8)] * 4))
