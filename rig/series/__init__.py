"""A whole test: the frames of a series correlated with one reference, into one file."""
