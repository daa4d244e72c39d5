"""Stiff and extreme cases of every package: what makes each hard, what is right, what is said.

Parts: plates, shells, rendering, correlation, estimation, loop.
"""

from rig.studies.stiff.correlation import correlation
from rig.studies.stiff.estimation import estimation, rendering
from rig.studies.stiff.loop import loop
from rig.studies.stiff.plates import plates
from rig.studies.stiff.shells import shells
from rig.studies.study import run

PARTS = {
    "plates": plates,
    "shells": shells,
    "rendering": rendering,
    "correlation": correlation,
    "estimation": estimation,
    "loop": loop,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
