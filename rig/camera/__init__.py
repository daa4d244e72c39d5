"""Cameras, and what stands for them: one protocol, a thread that always drains, fixed controls."""

from rig.camera.camera import Camera
from rig.camera.controls import Controls, Knob, Setting
from rig.camera.device import Device, InOrder

__all__ = ["Camera", "Controls", "Device", "InOrder", "Knob", "Setting"]
