"""Presses of a list, as a collection takes them out of images that were recorded.

They cannot be pressed once more: one that shows no touch is left out by name, and the others count.
Each is looked for by itself, in the mean of its images, so nothing that a press before it has left
holds it up.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import fe
from rig.calibration.bench_presses import Listed, ShownPress, knowing_presses, shown_press
from rig.calibration.collect import Taken
from rig.calibration.press_images import PressImages
from rig.live.baseline import still_reference
from rig.live.bench import Bench
from rig.live.chain import Chain


@dataclass(frozen=True, eq=False)
class SeenPresses:
    """What recorded images show of a list of presses.

    Attributes
    ----------
    chain : Chain
        That found them, on the reference of the images.
    shown : tuple of (Listed, ShownPress)
        Presses that show a touch.
    left_out : tuple of str
        Why each of the others does not count, as a sentence that names it.
    """

    chain: Chain
    shown: tuple[tuple[Listed, ShownPress], ...]
    left_out: tuple[str, ...]


def see_presses(bench: Bench, listed: Sequence[Listed], images: PressImages) -> SeenPresses:
    """Look for the touch of each listed press in the mean of its images.

    Parameters
    ----------
    bench : Bench
        Looks for one touch.
    listed : sequence of Listed
    images : PressImages
        Of these presses.

    Raises
    ------
    ValueError
        If something moves in the first images, or half of the presses or more do not count: then
        the list is another's.
    """
    seen = list(zip(listed, images.means, strict=True))
    chain = bench.prepare(still_reference(images.reference))[0]
    chain = knowing_presses(chain, seen)
    shown: list[tuple[Listed, ShownPress]] = []
    left_out: list[str] = []
    for one, image in seen:
        try:
            each = shown_press(chain, one, image)
        except ValueError as error:
            left_out.append(str(error))
            continue
        if each.evident:
            shown.append((one, each))
        else:
            left_out.append(f"the images of press {one.press} show no touch")
    if 2 * len(left_out) >= len(listed):
        raise ValueError(
            f"{len(left_out)} of {len(listed)} listed presses cannot be taken, the first because"
            f" {left_out[0]}; check that list and images belong together"
        )
    return SeenPresses(chain, tuple(shown), tuple(left_out))


def known_presses(shown: Sequence[tuple[Listed, ShownPress]]) -> Iterator[Taken]:
    """Give the presses whose place and force are listed, as a collection takes them."""
    for one, each in shown:
        if one.place is not None and one.force is not None:
            (first, last), press = one.frames, fe.Touch(*one.place, one.force)
            yield Taken(press, each.touch, each.sigma, last - first + 1)
