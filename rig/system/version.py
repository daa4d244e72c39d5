"""Version of the installed package."""

from importlib import metadata

__version__ = metadata.version("touchplate")
"""Version of the installed package, as pip names it."""
