"""Stiff and extreme cases of every package: what makes each hard, what is right, what is said.

Parts: plates, rendering, correlation, estimation.
"""

from stiff_correlation import correlation
from stiff_estimation import estimation, rendering
from stiff_plates import plates
from study import run

PARTS = {
    "plates": plates,
    "rendering": rendering,
    "correlation": correlation,
    "estimation": estimation,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
