"""Deflected plates for people: plots, and VTU for ParaView."""
