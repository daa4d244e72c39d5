"""Start-up, first steps, and what scenes leave out."""
