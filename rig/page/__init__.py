"""The operator page: a loopback web server that shows the newest frame of the live loop."""

from rig.page.server import Publisher, serve

__all__ = ["Publisher", "serve"]
