"""OpenCV kept from writing on stderr what we say in a sentence."""

from collections.abc import Generator
from contextlib import contextmanager

import cv2


@contextmanager
def quiet() -> Generator[None]:
    """Keep OpenCV silent while the block lasts."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
