"""What holds for every test: none is skipped in CI, kernels are fresh, a GPU is there if needed."""

import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path

import hypothesis
import numpy as np
import pytest

ROOT = Path(__file__).parent.parent


def kernel_folder():
    """Folder of compiled kernels, named by their sources.

    numba looks at the file of a kernel alone, not at those of the kernels that it calls. Those of
    `models` call what stands in files with kernels; the others take constants from anywhere.
    """
    rooms = ("dic", "fe", "synthetic", "models")
    sources = {path: path.read_bytes() for room in rooms for path in (ROOT / room).rglob("*.py")}
    kept = [
        content
        for path, content in sorted(sources.items())
        if path.relative_to(ROOT).parts[0] != "models" or b"njit" in content
    ]
    key = hashlib.sha256(b"".join(kept)).hexdigest()[:16]
    return Path(tempfile.gettempdir()) / f"touchplate-kernels-{key}"


# At once, not in a hook: the conftest of a room that is named on the command line imports numba
# before any hook runs, and numba reads where its files lie when it is imported.
os.environ["NUMBA_CACHE_DIR"] = str(kernel_folder())


hypothesis.settings.register_profile("untimed", deadline=None)  # a time is a benchmark, no test
hypothesis.settings.load_profile("untimed")


def pytest_collection_modifyitems(config, items):
    """Leave out what needs a GPU where there is none: no machine of CI has one."""
    of_gpu = [item for item in items if item.get_closest_marker("gpu")]
    if of_gpu and not has_gpu():
        items[:] = [item for item in items if item not in of_gpu]
        config.hook.pytest_deselected(items=of_gpu)


def has_gpu():
    try:
        import torch
    except ImportError:
        return False
    return torch.cuda.is_available()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if report.skipped and os.environ.get("CI") == "true" and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"{item.nodeid} was skipped, and in CI no test may be: {report.longrepr}"
    return report


@pytest.fixture(scope="session")
def modal_bench():
    """Give forward models of plates in fifty modes, just as described, by plate and noise.

    Every amplitude is measured, with that standard deviation in mm².
    """
    import fe
    import models

    modal = cache(lambda plate: fe.modal_plate(plate, 50, fe.grid(plate, 20)))

    def forward(plate, noise):
        fields = models.BenchFields(fe.BenchPlate(modal(plate), fe.bench_values()))
        return models.BenchForward(fields, np.eye(fields.count + fields.drifts) / noise)

    return forward
