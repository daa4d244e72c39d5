"""Lists of presses, changed."""

from dataclasses import asdict
from pathlib import Path

from rig.calibration.bench_presses import read_list
from rig.studies.files.kind import Kind, Wrong
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutation import mutate_text

LIST = """press,first_frame,last_frame,x_mm,y_mm,force_n
a,16,20,60.5,45,2
b,30,34,,,1.5
"middle, by hand",40,52,127.25,127,
d,60,60,,,
"""


def make_list(path: Path) -> None:
    """Write a list with all that one may say and leave out."""
    path.write_text(LIST, encoding="utf-8")


def read_presses(path: Path) -> Wrong:
    """Read a list."""
    for one in read_list(path):
        yield from out_of_range(asdict(one))
        if min(one.frames) < 0 or one.frames[0] > one.frames[1]:
            yield f"frames = {one.frames}"


PRESS_LIST = Kind(".csv", make_list, mutate_text, read_presses)
