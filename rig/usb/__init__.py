"""What hangs on the USB: found, watched, reset and driven through pyusb."""

from rig.usb.board import UsbBoard, open_board
from rig.usb.devices import UsbDevice, list_devices
from rig.usb.watch import DeviceChange, Watch

__all__ = ["DeviceChange", "UsbBoard", "UsbDevice", "Watch", "list_devices", "open_board"]
