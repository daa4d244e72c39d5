"""Rendering: how exact, how fast."""
