"""Touches on a bent and twisted base, seen by the camera."""
