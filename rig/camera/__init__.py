"""Cameras, and what stands for them: one protocol, a thread that always drains, fixed controls."""

from rig.camera.camera import LiveCamera
from rig.camera.controls import Controls, ControlSetting, Knob
from rig.camera.device import InOrder, OpenDevice

__all__ = ["ControlSetting", "Controls", "InOrder", "Knob", "LiveCamera", "OpenDevice"]
