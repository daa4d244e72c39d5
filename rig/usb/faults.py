"""What goes wrong on the USB: one sentence each, with what to do about it."""

# pyusb has no stubs, and types of its own for little of what it gives.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from __future__ import annotations

import errno
from collections.abc import Generator
from contextlib import contextmanager

import usb.core

SENTENCES = {
    errno.EACCES: "no permission to use {name}; install the rule that 'touchplate doctor' prints",
    errno.EPERM: "no permission to use {name}; install the rule that 'touchplate doctor' prints",
    errno.ENODEV: "{name} was unplugged; plug it in again",
    errno.EBUSY: "{name} is in use; close the program that uses it",
    errno.EPIPE: "{name} refused the request; its firmware does not know it, or not now",
    errno.ETIMEDOUT: "{name} does not answer; reset it or plug it in again",
}


@contextmanager
def faults(name: str) -> Generator[None]:
    """Turn the errors of pyusb in the block into an OSError with a sentence about `name`."""
    try:
        yield
    except usb.core.USBTimeoutError:
        raise OSError(SENTENCES[errno.ETIMEDOUT].format(name=name)) from None
    except usb.core.NoBackendError:
        raise OSError(
            "libusb is not installed; run 'apt install libusb-1.0-0' or what your system has for it"
        ) from None
    except usb.core.USBError as error:
        sentence = SENTENCES.get(error.errno or 0)
        text = sentence.format(name=name) if sentence else f"{name} failed: {error.strerror}"
        raise OSError(text) from None
