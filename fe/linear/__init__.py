"""Kirchhoff's plate: states, influences, modes, and the range in which it holds."""
