"""Tile sums: all that a frame says of small motions, for estimates at the rate of a camera."""
