"""The live chain: frame → mask and illumination → tile sums → estimate → tracks → snapshot."""
