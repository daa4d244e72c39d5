"""Frames by their content: the same wherever they lie, others whatever they are called."""

import numpy as np
from PIL import Image

from rig.series.content import digest_of
from rig.series.frames import open_frames


def test_a_file_is_known_again_under_another_name_and_any_block_that_differs_is_seen(tmp_path):
    content = np.random.default_rng(1).bytes(300_000)
    first, again, other = (tmp_path / name for name in ("a", "b", "c"))
    first.write_bytes(content)
    again.write_bytes(content)
    assert digest_of(first) == digest_of(again) != ""
    noisy = np.frombuffer(content, np.uint8) ^ np.random.default_rng(2).integers(
        0, 2, len(content), np.uint8
    )
    for changed in (content[:-1], content + b"x", content[:-1] + b"?", noisy.tobytes(), b""):
        other.write_bytes(changed)
        assert digest_of(other) != digest_of(first)
    assert digest_of(tmp_path / "none") == ""


def test_of_each_source_every_frame_has_a_digest(tmp_path):
    rng = np.random.default_rng(3)
    images = [Image.fromarray(rng.integers(0, 255, (40, 50), np.uint8)) for _ in range(4)]
    images[0].save(tmp_path / "a.png")
    images[1].save(tmp_path / "b.tif", save_all=True, append_images=images[2:])
    frames = open_frames(str(tmp_path / "*.*"))
    assert len(frames.contents()) == len(frames.names) == 4
    assert frames.contents()[0] == digest_of(tmp_path / "a.png")
    assert set(frames.contents()[1:]) == {digest_of(tmp_path / "b.tif")}
