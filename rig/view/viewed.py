"""What the page shows: the images of a test, its result, or both; and the correlation that runs."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import RLock

from rig.series.frames import Frames, open_frames
from rig.series.noise import ImageNoise, image_noise
from rig.series.read import SeriesResult, open_result
from rig.series.regions import Regions
from rig.system.arrays import AnyArray
from rig.view.fields import for_looking
from rig.view.job import Job

_RESULT = "fields.h5"


@dataclass(frozen=True)
class SomeFrames:
    """Chosen frames of others, as frames of their own."""

    source: Frames
    numbers: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the chosen ones."""
        names = self.source.names
        return tuple(names[number] for number in self.numbers)

    def read(self, number: int) -> AnyArray:
        """Read one of the chosen ones."""
        return self.source.read(self.numbers[number])

    def contents(self) -> tuple[str, ...]:
        """Digests of the chosen ones."""
        contents = self.source.contents()
        return tuple(contents[number] for number in self.numbers)


class ViewedTest:
    """A test that a page looks at; use it in a `with` block.

    Parameters
    ----------
    frames : Frames or None
        Its images; None where only a result is there.
    result : Path or None
        Its result; None where it is still to be correlated.
    out : Path
        Folder that a correlation writes to.
    regions : Regions
        That the page begins with.
    interval : float or None, s
        Time from frame to frame; None where frames are counted.

    Raises
    ------
    OSError
        The result cannot be read.
    ValueError
        There is one image and nothing to compare it with, or the images are not those of the
        result.
    """

    def __init__(
        self,
        frames: Frames | None,
        result: Path | None,
        out: Path,
        regions: Regions | None = None,
        interval: float | None = None,
    ) -> None:
        self.frames, self.out, self.interval = frames, out, interval
        self.regions = regions or Regions()
        self.job = Job()
        self._lock, self._open = RLock(), ExitStack()
        self._result: SeriesResult | None = None
        self._noise: dict[str, ImageNoise] = {}
        if result is not None:
            self.show(result)
        elif frames is not None and len(frames.names) < 2:
            raise ValueError(
                f"'{', '.join(frames.names)}' is one image, and a field needs two or more; name a"
                " folder or a pattern with the image before and those after"
            )

    def __enter__(self) -> ViewedTest:
        return self

    def __exit__(self, *about: object) -> None:
        self.job.stop()
        with self._lock:
            self._result = None
            self._open.close()

    @contextmanager
    def reading(self) -> Generator[SeriesResult | None]:
        """Give the result, which stays open while the block runs; None where there is none yet."""
        with self._lock:
            yield self._result

    @contextmanager
    def result(self) -> Generator[SeriesResult]:
        """Give the result.

        Raises
        ------
        ValueError
            There is none yet.
        """
        with self.reading() as result:
            if result is None:
                raise ValueError("there is no field yet; correlate the images first")
            yield result

    def show(self, path: Path) -> None:
        """Open a result in the place of the one before, or leave that if it cannot be read."""
        opened = ExitStack()
        result = for_looking(opened.enter_context(open_result(path)))
        try:
            self._check(result)
        except ValueError:
            opened.close()
            raise
        with self._lock:
            self._open.close()
            self._open, self._result = opened, result

    def _check(self, result: SeriesResult) -> None:
        if self.frames is None:
            return
        missing = set(result.names) - set(self.frames.names)
        if missing:
            raise ValueError(
                f"'{result.path}' is of frame '{min(missing)}', which is not among the"
                f" {len(self.frames.names)} images named; name those of the test"
            )

    def image(self, name: str) -> AnyArray:
        """Read the image of a frame by its name.

        Raises
        ------
        ValueError
            There is none of that name.
        OSError
            It cannot be read.
        """
        if self.frames is None or name not in self.frames.names:
            raise ValueError(f"there is no image '{name}'; name the images with --frames")
        return self.frames.read(self.frames.names.index(name))

    def noise(self, name: str) -> ImageNoise:
        """Measure the noise of the images, between the one of this name and its neighbour.

        Raises
        ------
        OSError, ValueError
            The image cannot be read or used.
        """
        if name not in self._noise:
            reference, other = self.image(name), self._neighbour(name)
            try:
                frame = self.image(other)
            except (OSError, ValueError):  # it is left out of the test too
                frame = None
            self._noise[name] = image_noise(reference, frame, other)
        return self._noise[name]

    def _neighbour(self, name: str) -> str:
        names = () if self.frames is None else self.frames.names
        number = names.index(name)
        return names[number + 1 if number + 1 < len(names) else number - 1]


def open_test(
    what: str,
    frames: str | None = None,
    out: Path | None = None,
    regions: Regions | None = None,
    interval: float | None = None,
) -> ViewedTest:
    """Open what a path or pattern names: a result, the folder of one, or images.

    Raises
    ------
    OSError
        It is not there, or cannot be read.
    ValueError
        As `ViewedTest`.
    """
    path, images = Path(what), None if frames is None else open_frames(frames)
    folder = out or Path("results") / "test"
    if path.is_dir() and (path / _RESULT).is_file():
        path = path / _RESULT
    if path.suffix.lower() in (".h5", ".hdf5"):
        return ViewedTest(images, path, folder, regions, interval)
    if images is not None:
        raise ValueError(f"'{what}' is no result, whose images --frames names; leave out one")
    return ViewedTest(open_frames(what), None, folder, regions, interval)
