"""Nets: recipes, training, search, storage, and the estimates that they give."""
