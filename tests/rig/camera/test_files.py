import cv2
import numpy as np
import pytest
from PIL import Image

import rig
from rig.camera import InOrder, LiveCamera
from rig.camera.files import ImageSequence, open_files, open_folder, open_video, read_times
from rig.sources.open_source import open_input

SHAPE = (32, 48)


@pytest.fixture
def folder(tmp_path):
    """Images 8 to 11, whose grey level is their number."""
    for number in range(8, 12):
        Image.fromarray(np.full(SHAPE, number, np.uint8)).save(tmp_path / f"frame_{number}.png")
    (tmp_path / "notes.txt").write_text("no image")
    return tmp_path


def test_images_come_in_the_order_of_their_numbers_and_end(folder):
    source = InOrder(open_folder(folder))
    frames = [source.grab(1.0) for _ in range(4)]
    assert [frame.image[0, 0] for frame in frames] == [8, 9, 10, 11]
    assert [frame.sequence for frame in frames] == [0, 1, 2, 3]
    assert frames[0].image.shape == SHAPE
    with pytest.raises(EOFError, match="has ended after"):
        source.grab(1.0)


def test_an_image_of_another_size_is_named(folder):
    Image.fromarray(np.zeros((24, 48), np.uint8)).save(folder / "frame_10.png")
    source = InOrder(open_folder(folder))
    assert [source.grab(1.0).sequence for _ in range(2)] == [0, 1]
    with pytest.raises(OSError, match=r"image 3 of .* has 48 x 24 px, those before have 48 x 32"):
        source.grab(1.0)


class Clock:
    """Time that passes only while somebody sleeps."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def drawn(rate, clock, count=4):
    images = iter(np.full((count, *SHAPE), 7, np.uint8))
    return ImageSequence("drawn", images, rate, clock, clock.sleep)


def test_a_folder_plays_as_a_camera_to_its_end(folder):
    with LiveCamera(lambda: open_folder(folder, rate=20)) as camera:
        while camera.grab(10.0).sequence < 3:
            pass
        with pytest.raises(EOFError, match=f"{folder} has ended after 4 images"):
            camera.grab(10.0)


def test_images_keep_their_rate_and_their_turn_however_late_they_are_read():
    clock = Clock()
    images = drawn(20.0, clock)
    early = [images.read(1.0) for _ in range(2)]
    clock.sleep(0.07)  # whoever reads is late: the third was due at 100.1
    frames = early + [images.read(1.0) for _ in range(2)]
    assert [frame.captured for frame in frames] == pytest.approx([100.0, 100.05, 100.1, 100.15])
    assert [frame.given for frame in frames] == pytest.approx([100.0, 100.05, 100.12, 100.15])


def test_images_without_a_rate_are_as_old_as_they_were_read():
    clock = Clock()
    images = drawn(None, clock)
    first = images.read(1.0)
    clock.sleep(3.0)
    second = images.read(1.0)
    assert (first.captured, second.captured) == (100.0, 103.0)
    assert second.given == 103.0


def test_an_image_that_is_not_due_is_waited_for_no_longer_than_asked():
    clock = Clock()
    images = drawn(0.1, clock)
    assert images.read(0.1) is not None
    assert images.read(0.05) is None
    assert clock.now == pytest.approx(100.05)
    assert images.read(60.0).captured == pytest.approx(110.0)


def test_a_video_gives_its_frames_in_grey(tmp_path):
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"FFV1"), 25.0, SHAPE[::-1])
    for number in range(5):
        writer.write(np.full((*SHAPE, 3), 40 * number, np.uint8))
    writer.release()
    source = InOrder(open_video(path))
    frames = [source.grab(1.0) for _ in range(5)]
    assert [frame.image[5, 5] for frame in frames] == pytest.approx([0, 40, 80, 120, 160], abs=1)
    assert frames[0].image.shape == SHAPE
    with pytest.raises(EOFError, match="has ended after"):
        source.grab(1.0)


def test_what_is_not_there_or_no_image_is_one_sentence(tmp_path):
    with pytest.raises(OSError, match=r"nowhere does not exist; check the path"):
        open_folder(tmp_path / "nowhere")
    with pytest.raises(OSError, match="holds no images"):
        open_folder(tmp_path)
    with pytest.raises(OSError, match=r"video .* does not exist"):
        open_video(tmp_path / "film.avi")
    (tmp_path / "text.avi").write_text("no video")
    with pytest.raises(OSError, match="is no video that can be read"):
        open_video(tmp_path / "text.avi")
    with pytest.raises(ValueError, match="rate must be positive, got 0 frames a second"):
        open_folder(tmp_path, rate=0)


def test_an_image_in_colour_is_one_sentence(tmp_path):
    Image.fromarray(np.arange(36, dtype=np.uint8).reshape(3, 4, 3)).save(tmp_path / "red.png")
    with pytest.raises(OSError, match="is not grey"):
        open_folder(tmp_path).read(1.0)


def test_an_image_of_16_bit_is_one_sentence(tmp_path):
    Image.fromarray(np.zeros(SHAPE, np.uint16)).save(tmp_path / "deep.png")
    with pytest.raises(OSError, match="has uint16 values; convert it to 8 bit"):
        open_folder(tmp_path).read(1.0)


def test_files_of_any_names_come_in_the_order_of_their_numbers(folder):
    for number in (9, 10):
        Image.fromarray(np.full(SHAPE, number, np.uint8)).save(folder / f"other {number} b.png")
    source = InOrder(open_files(folder / "other*.png"))
    assert [source.grab(1.0).image[0, 0] for _ in range(2)] == [9, 10]
    source = InOrder(open_files(folder / "frame_1?.*"))
    assert [source.grab(1.0).image[0, 0] for _ in range(2)] == [10, 11]


def test_images_bear_the_times_when_they_were_taken():
    clock = Clock()
    images = iter(np.full((3, *SHAPE), 7, np.uint8))
    taken = ImageSequence("drawn", images, None, clock, clock.sleep, [5.0, 5.5, 7.0])
    assert taken.read(1.0).captured == 100.0
    clock.now = 100.7  # the second is late
    assert taken.read(1.0).captured == 100.5
    assert taken.read(1.0) is None
    assert taken.read(1.0).captured == 102.0
    with pytest.raises(EOFError):
        taken.read(1.0)


@pytest.mark.parametrize(
    "text", ["1.5\n2\n3e0\n", "frame,time_s\na,1.5\nb,2\nc,3\n", "t\n1.5\n2\n3"]
)
def test_times_are_read_from_a_column_of_a_table(tmp_path, text):
    path = tmp_path / "times.csv"
    path.write_text(text)
    assert read_times(path, 3) == [1.5, 2.0, 3.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1\n2\n", "has 2 times and there are 3 images; give one each"),
        ("1\n2\n2\n", "must be numbers in s that grow; correct them there"),
        ("1\nnan\n3\n", "must be numbers in s that grow"),
        ("1\n2\nthree\n", "must be numbers in s that grow"),
        ("", "has 0 times"),
    ],
)
def test_times_that_do_not_fit_are_one_sentence(tmp_path, text, said):
    path = tmp_path / "times.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=said):
        read_times(path, 3)


def test_files_that_are_not_there_are_one_sentence(folder):
    with pytest.raises(OSError, match=r"no image is called '.*notes\*'; PNG, TIFF"):
        open_files(folder / "notes*")
    with pytest.raises(OSError, match="of the times does not exist; check the path"):
        open_files(folder / "frame*", times=folder / "times.csv")


def test_a_scene_names_files_and_their_times(folder):
    (folder / "times.csv").write_text("0\n0.01\n0.02\n0.05\n")
    source = {"kind": "files", "path": f"{folder}/frame_*.png", "times": f"{folder}/times.csv"}
    scene = rig.load("bench", {"source": source})
    with open_input(scene, lambda said: None) as (opened, reference):
        frames = [opened.grab(5.0) for _ in range(4)]
    assert reference is None
    taken = [frame.captured - frames[0].captured for frame in frames]
    assert taken == pytest.approx([0, 0.01, 0.02, 0.05], abs=1e-6)
