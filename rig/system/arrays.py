"""Short names for the types of arrays."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

AnyArray: TypeAlias = NDArray[Any]
"""Images as a camera gives them, and whatever a file holds."""
F32: TypeAlias = NDArray[np.float32]
F64: TypeAlias = NDArray[np.float64]
Grey: TypeAlias = NDArray[np.uint8]
"""Grey levels of 8 bit."""
I64: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]
Real: TypeAlias = NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
"""Any array of real numbers."""
