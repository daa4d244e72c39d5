"""Stiff and extreme cases of every package: what makes each hard, what is right, what is said.

Parts: plates, shells, rendering, correlation, estimation, loop.
"""

from stiff_correlation import correlation
from stiff_estimation import estimation, rendering
from stiff_loop import loop
from stiff_plates import plates
from stiff_shells import shells
from study import run

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
