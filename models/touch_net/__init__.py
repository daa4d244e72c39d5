"""The touch net: from what a whole pattern measured to touches, their number and scatter."""
