"""Commands of `touchplate`, one a file."""
