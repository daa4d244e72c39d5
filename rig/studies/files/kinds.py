"""Every kind of file that the program reads."""

from collections.abc import Mapping

from rig.studies.files.array_nets import ARRAY_NET
from rig.studies.files.cached import CACHE, KERNEL
from rig.studies.files.calibrations import CALIBRATION
from rig.studies.files.kind import Kind
from rig.studies.files.nets import MODEL
from rig.studies.files.press_lists import PRESS_LIST
from rig.studies.files.recordings import RECORDING
from rig.studies.files.region_files import REGIONS
from rig.studies.files.scenes import SCENE
from rig.studies.files.setups import SETUP

KINDS: Mapping[str, Kind] = {
    "cache": CACHE,
    "calibration": CALIBRATION,
    "kernel": KERNEL,
    "model": MODEL,
    "recording": RECORDING,
    "scene": SCENE,
    "setup": SETUP,
    "net of arrays": ARRAY_NET,
    "list of presses": PRESS_LIST,
    "regions": REGIONS,
}
"""A new one comes last: how files are changed is drawn by the number of their kind."""
