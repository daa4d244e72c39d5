"""OpenCV, and FFmpeg in it, kept from writing on stderr what we say in a sentence."""

import os
from collections.abc import Generator
from contextlib import contextmanager

import cv2

_FFMPEG, _NOTHING = "OPENCV_FFMPEG_LOGLEVEL", "-8"


@contextmanager
def quiet() -> Generator[None]:
    """Keep OpenCV silent while the block lasts.

    FFmpeg takes its level once, from the environment where the first video is opened, and keeps it;
    one that is set there already stays.
    """
    os.environ.setdefault(_FFMPEG, _NOTHING)
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
