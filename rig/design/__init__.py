"""Bench design: what a scene promises before it is built."""
