"""The live loop on a base that bends and twists: its shape from the image, and touches on it."""
