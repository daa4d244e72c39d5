"""Basler cameras through pypylon, which brings its own drivers (extra "vision")."""

from __future__ import annotations

import time
from importlib import import_module
from typing import Any

from rig.camera.controls import Controls, ControlSetting
from rig.camera.nodes import DeviceClock, by_pulses, set_up
from rig.system.frame import Frame
from rig.system.optional import need

TICKS = 1e9  # a second, of USB3 cameras; GigE cameras say theirs


class BaslerCamera:
    """A `Device` on an open camera of pypylon; use `open_basler`."""

    def __init__(self, camera: Any, name: str, settings: tuple[ControlSetting, ...]):
        self.name, self.settings = name, settings
        self._camera = camera
        self._pylon = import_module("pypylon.pylon")
        self._clock = DeviceClock()
        self._ticks = BaslerNodes(camera).get("GevTimestampTickFrequency") or TICKS
        camera.StartGrabbing(self._pylon.GrabStrategy_OneByOne)

    def read(self, timeout: float) -> Frame | None:
        """See `Device.read`; an image that was damaged on the way is left out."""
        try:
            result = self._camera.RetrieveResult(
                max(1, round(1e3 * timeout)), self._pylon.TimeoutHandling_Return
            )
        except self._pylon.GenericException as error:
            raise OSError(f"{self.name} has gone ({error}); plug it in again") from None
        if self._camera.IsCameraDeviceRemoved():
            raise OSError(f"{self.name} has gone; plug it in again")
        if not result.IsValid():
            return None
        with result:
            if not result.GrabSucceeded():
                return None
            captured = self._clock.ours(result.TimeStamp / self._ticks, time.monotonic())
            return Frame(result.BlockID, captured, result.Array.copy())

    def close(self) -> None:
        """See `Device.close`."""
        self._camera.Close()


def open_basler(
    serial: str,
    size: tuple[int, int],
    rate: float,
    controls: Controls,
    trigger: str | None = None,
) -> BaslerCamera:
    """Open a camera and hold its controls; parameters as in `rig.camera.genicam`.

    Raises
    ------
    OSError
        If pypylon is missing, or the camera is, is in use, or lacks this size or input.
    """
    need("pypylon", "vision")
    pylon = import_module("pypylon.pylon")
    factory = pylon.TlFactory.GetInstance()
    known = {info.GetSerialNumber(): info for info in factory.EnumerateDevices()}
    if serial not in known:
        there = ", ".join(sorted(known)) or "none at all"
        raise OSError(f"no Basler camera has serial number {serial} (there is {there}); plug it in")
    name = known[serial].GetFriendlyName()
    try:
        camera = pylon.InstantCamera(factory.CreateDevice(known[serial]))
        camera.Open()
    except pylon.GenericException as error:
        raise OSError(f"{name} does not open ({error}); is it in use?") from None
    try:
        settings = set_up(BaslerNodes(camera), name, size, rate, controls, trigger)
    except OSError:
        camera.Close()
        raise
    return BaslerCamera(camera, by_pulses(name, trigger), settings)


class BaslerNodes:
    """Features of a camera of pypylon; see `rig.camera.nodes.Nodes`."""

    def __init__(self, camera: Any):
        self._camera = camera
        self._error = import_module("pypylon.genicam").GenericException

    def get(self, name: str) -> Any:
        """See `Nodes.get`."""
        try:
            return getattr(self._camera, name).Value
        except (self._error, AttributeError):
            return None

    def set(self, name: str, value: Any) -> bool:
        """See `Nodes.set`."""
        try:
            getattr(self._camera, name).Value = value
        except (self._error, AttributeError, TypeError):
            return False
        return True
