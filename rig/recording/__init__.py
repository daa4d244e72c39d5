"""Recordings: one HDF5 file a session, which holds what the loop saw and what it said.

HDF5 is imported where a file is opened: a run that records nothing never loads it.
"""
