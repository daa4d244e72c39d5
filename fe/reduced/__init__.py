"""Large deflection of a plate at a live pace, made from states of the whole plate."""

from fe.reduced.large_state import LargeState
from fe.reduced.making import reduced_plate
from fe.reduced.reduced import Reduced
from fe.reduced.result import Trust
from fe.reduced.view import Reading, ReducedReadings

__all__ = ["LargeState", "Reading", "Reduced", "ReducedReadings", "Trust", "reduced_plate"]
