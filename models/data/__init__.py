"""Data sets: which touches are drawn, what gauges read of them, and their files."""
