"""The plate, its edges and its touches, with units, checked once."""
