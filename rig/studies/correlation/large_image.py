"""A full field of 25 megapixels: CPU time and memory of one process, and the error beside them."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rig.report.figure import Figure, at_most
from rig.studies.study import line, run
from rig.system.arrays import F64, AnyArray

SIDE = 5000  # px
SHIFT = (0.4, 0.2)  # px
NOISE, CONTRAST = 2.0, 56.0  # grey levels
SPECKLE = 1.8  # px, of the Gaussian that makes them

PROGRAM = f"""
import json, resource, time
import numpy as np
import dic
first, second = np.load("first.npy"), np.load("second.npy")
dic.correlate(dic.prepare(first[:300, :300]), second[:300, :300])
before = time.process_time()
found = dic.correlate(dic.prepare(first), second)
spent = time.process_time() - before
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
off = np.sqrt(np.nanmean(np.square([found.u - {SHIFT[0]}, found.v - {SHIFT[1]}])))
print(json.dumps([spent, peak, float(found.valid.mean()), float(off), len(found.xy)]))
"""
"""Prepare and correlate as it comes, once the kernels are compiled, in a process of its own."""


def large() -> Iterator[Figure]:
    """Correlate noise through a Gaussian, moved by the phase of its spectrum, of two draws."""
    with TemporaryDirectory() as folder:
        for name, image in zip(("first", "second"), _pair(), strict=True):
            np.save(Path(folder) / f"{name}.npy", image)
        said = subprocess.run(
            [sys.executable, "-c", PROGRAM], cwd=folder, check=True, capture_output=True, text=True
        )
    spent, peak, valid, off, count = json.loads(said.stdout)
    yield from line(
        "Large image",
        "25 MP, subset 21, step 5",
        time=(spent, "CPU s", at_most(8.0), count),
        memory=(peak, "MB", at_most(2000.0)),
        valid=(100 * valid, "%"),
        error=(1e3 * off, "mpx, rms"),
    )


def _pair() -> Iterator[AnyArray]:
    """Draw reference and frame, uint8."""
    rng = np.random.default_rng(25)
    along, down = np.fft.rfftfreq(SIDE), np.fft.fftfreq(SIDE)[:, None]
    seen = np.exp(-2 * (np.pi * SPECKLE) ** 2 * (along**2 + down**2))
    spectrum = np.fft.rfft2(rng.normal(size=(SIDE, SIDE))) * seen
    for u, v in ((0.0, 0.0), SHIFT):
        plain: F64 = np.fft.irfft2(spectrum * np.exp(-2j * np.pi * (u * along + v * down)))
        grey = 128 + CONTRAST / plain.std() * plain + rng.normal(0, NOISE, plain.shape)
        yield np.clip(np.rint(grey), 0, 255).astype(np.uint8)


PARTS = {"large": large}

if __name__ == "__main__":
    run(PARTS, __doc__)
