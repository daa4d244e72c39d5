"""Stiff and extreme cases of every package: what makes each hard, what is right, what is said.

Parts: plates.
"""

from stiff_plates import plates
from study import run

PARTS = {"plates": plates}

if __name__ == "__main__":
    run(PARTS, __doc__)
