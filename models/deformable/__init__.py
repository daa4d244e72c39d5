"""A plate whose base bends and twists: its shape from the image, and touches on that shape."""
