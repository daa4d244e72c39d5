"""Plates that are slow to compute, kept in the cache: modes, influences, reduced plates."""
