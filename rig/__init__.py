"""The bench: scenes, cameras, projector, live loop, operator page and commands."""
