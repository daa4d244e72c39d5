"""A command or an import in a process of its own: how long, how much memory, which modules."""

import json
import subprocess
import sys
import time
from typing import NamedTuple

HEAVY = (
    "torch kornia optuna sklearn dask numba scipy cv2 skimage matplotlib h5py pydantic starlette "
    "uvicorn pygame usb linuxpy pylsl"
)
_TELL = f"""
import json, sys
from pathlib import Path
known = Path("/proc/self/status")
lines = known.read_text().splitlines() if known.exists() else []
memory = next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")), 0.0)
loaded = [name for name in "{HEAVY}".split() if name in sys.modules]
sys.stderr.write(json.dumps([memory, loaded]))
"""
_COMMAND = """
from rig.cli import application
words = {words!r}
try:
    application(words)(words)
except SystemExit as ended:
    if ended.code:
        raise
"""


class Seen(NamedTuple):
    """What was seen of a process.

    Attributes
    ----------
    seconds : float
        Wall time from start to end.
    memory : float, MB
        The most that it held, 0 where the system does not say; not of processes that it started.
    modules : tuple of str
        The heavy ones among those that it imported.
    said : str
        What it printed.
    """

    seconds: float
    memory: float
    modules: tuple[str, ...]
    said: str


def command(*words: str) -> Seen:
    """Run `touchplate` with these words."""
    return _observed(_COMMAND.format(words=list(words)))


def importing(package: str) -> Seen:
    """Import a package and nothing else."""
    return _observed(f"import {package}")


def _observed(code: str) -> Seen:
    began = time.perf_counter()
    ended = subprocess.run(
        [sys.executable, "-P", "-c", code + _TELL], capture_output=True, text=True, check=True
    )
    seconds = time.perf_counter() - began
    memory, modules = json.loads(ended.stderr.splitlines()[-1])
    return Seen(seconds, memory, tuple(modules), ended.stdout)
