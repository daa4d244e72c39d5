"""Gestures of scripted hands."""
