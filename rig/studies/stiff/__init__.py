"""Stiff and extreme cases of every package."""
