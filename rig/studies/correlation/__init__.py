"""Correlation on images whose motion is known, and beside its peers."""
