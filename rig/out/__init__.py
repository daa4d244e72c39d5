"""Touches for other programs: TUIO over UDP, JSON over a websocket, LSL."""

from rig.out.cursors import Cursor, Cursors, across_plate, across_screen
from rig.out.tuio import Tuio

__all__ = ["Cursor", "Cursors", "Tuio", "across_plate", "across_screen"]
