"""Packages that only some benches need: asked for when such a part is, and not before."""

from importlib.util import find_spec


def need(package: str, extra: str) -> None:
    """Make sure that a package is installed.

    Raises
    ------
    OSError
        With the command that installs it.
    """
    if find_spec(package) is None:
        raise OSError(
            f"{package} is not installed and this part needs it; run"
            f" pip install 'touchplate[{extra}]'"
        )
