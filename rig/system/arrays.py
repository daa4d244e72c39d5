"""Short names for the types of arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Grey = NDArray[np.uint8]
"""Grey levels of 8 bit."""
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Real = NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
"""Any array of real numbers."""
