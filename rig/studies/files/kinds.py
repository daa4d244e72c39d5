"""Every kind of file that the program reads."""

from collections.abc import Mapping

from rig.studies.files.cached import CACHE, KERNEL
from rig.studies.files.calibrations import CALIBRATION
from rig.studies.files.kind import Kind
from rig.studies.files.nets import MODEL
from rig.studies.files.recordings import RECORDING
from rig.studies.files.scenes import SCENE
from rig.studies.files.setups import SETUP

KINDS: Mapping[str, Kind] = {
    "scene": SCENE,
    "calibration": CALIBRATION,
    "setup": SETUP,
    "model": MODEL,
    "recording": RECORDING,
    "cache": CACHE,
    "kernel": KERNEL,
}
