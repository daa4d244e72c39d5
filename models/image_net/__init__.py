"""The image net: learned on rendered speckle, it refines a warped pair of images."""
