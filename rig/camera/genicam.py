"""Any GenICam camera through harvesters and the GenTL producer of its maker (extra "vision")."""

from __future__ import annotations

import time
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from rig.camera.controls import Controls, ControlSetting
from rig.camera.nodes import DeviceClock, by_pulses, set_up
from rig.system.frame import Frame
from rig.system.optional import need

NANOSECOND = 1e-9


class GenicamCamera:
    """A `Device` on an image acquirer of harvesters; use `open_genicam`."""

    def __init__(
        self, harvester: Any, acquirer: Any, name: str, settings: tuple[ControlSetting, ...]
    ):
        self.name, self.settings = name, settings
        self._harvester, self._acquirer = harvester, acquirer
        self._error = import_module("genicam.gentl").GenericException
        self._clock = DeviceClock()
        acquirer.start()

    def read(self, timeout: float) -> Frame | None:
        """See `Device.read`."""
        try:
            buffer = self._acquirer.try_fetch(timeout=timeout)
        except self._error as error:
            raise OSError(f"{self.name} has gone ({error}); plug it in again") from None
        if buffer is None:
            return None
        try:
            part = buffer.payload.components[0]
            image = np.asarray(part.data).reshape(part.height, part.width).astype(np.uint8)
            captured = self._clock.ours(self._stamp(buffer), time.monotonic())
            return Frame(buffer.module.frame_id, captured, image)
        finally:
            buffer.queue()

    def close(self) -> None:
        """See `Device.close`."""
        try:
            self._acquirer.destroy()
        except self._error:  # it has gone before
            pass
        finally:
            self._harvester.reset()

    def _stamp(self, buffer: Any) -> float:
        """Time on the camera's clock, s; 0 where it has none."""
        try:
            return buffer.module.timestamp_ns * NANOSECOND
        except self._error:
            return 0.0


def open_genicam(
    producer: str | Path,
    serial: str,
    size: tuple[int, int],
    rate: float,
    controls: Controls,
    trigger: str | None = None,
) -> GenicamCamera:
    """Open a camera and hold its controls.

    Parameters
    ----------
    producer : str or Path
        The maker's GenTL producer, a file that ends in ``.cti``.
    serial : str
        Serial number of the camera.
    size : (int, int), px
        Width and height.
    rate : float, frames a second
    controls : Controls
    trigger : str or None
        Input whose rising edge takes each frame; None where the camera keeps the rate by itself.

    Raises
    ------
    OSError
        If harvesters or the producer is missing, or the camera is, is in use, or lacks this size or
        input.
    """
    need("harvesters", "vision")
    core, errors = import_module("harvesters.core"), import_module("genicam.gentl")
    if not Path(producer).is_file():
        raise OSError(
            f"GenTL producer '{producer}' does not exist; install the maker's software and name"
            " its .cti file"
        )
    harvester = core.Harvester()
    try:
        harvester.add_file(str(producer))
        harvester.update()
        name = _find(harvester, serial)
        acquirer = harvester.create({"serial_number": serial})
        settings = set_up(GenicamNodes(acquirer), name, size, rate, controls, trigger)
        return GenicamCamera(harvester, acquirer, by_pulses(name, trigger), settings)
    except errors.GenericException as error:
        harvester.reset()
        raise OSError(f"camera {serial} does not open ({error}); is it in use?") from None
    except OSError:
        harvester.reset()
        raise


class GenicamNodes:
    """Features of an acquirer; see `rig.camera.nodes.Nodes`."""

    def __init__(self, acquirer: Any):
        self._map = acquirer.remote_device.node_map
        self._error = import_module("genicam.genapi").GenericException

    def get(self, name: str) -> Any:
        """See `Nodes.get`."""
        try:
            return getattr(self._map, name).value if self._map.has_node(name) else None
        except self._error:
            return None

    def set(self, name: str, value: Any) -> bool:
        """See `Nodes.set`."""
        try:
            if not self._map.has_node(name):
                return False
            getattr(self._map, name).value = value
        except (self._error, TypeError):  # refused, or whole numbers alone
            return False
        return True


def _find(harvester: Any, serial: str) -> str:
    """Name of the camera with this serial number."""
    known = {camera.serial_number: camera.display_name for camera in harvester.device_info_list}
    if serial not in known:
        there = ", ".join(sorted(known)) or "none at all"
        raise OSError(f"no camera has serial number {serial} (there is {there}); plug it in")
    return known[serial]
