"""What hangs on the USB: found, watched, reset and driven through pyusb."""

from rig.usb.board import Board, open_board
from rig.usb.devices import UsbDevice, list_devices
from rig.usb.watch import Change, Watch

__all__ = ["Board", "Change", "UsbDevice", "Watch", "list_devices", "open_board"]
