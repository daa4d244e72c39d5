"""How long a plate may be against its width, where elements grow with its length."""

from __future__ import annotations

from fe.plate.plate import Plate


def check_aspect(plate: Plate, longest: float) -> None:
    """Raise where a plate is so long that its elements would fill the memory.

    Parameters
    ----------
    plate : Plate
    longest : float
        Longer side over the shorter one, up to which it works.

    Raises
    ------
    ValueError
        The plate is longer.
    """
    aspect = max(plate.size) / min(plate.size)
    if aspect > longest:
        raise ValueError(
            f"plate must be at most {longest:g} times as long as wide, got {plate.size[0]:g} x "
            f"{plate.size[1]:g} mm, {aspect:.4g} times; leave out of it what is far from touches"
        )
