"""Scores: estimates matched with true touches, and errors over the plate."""
