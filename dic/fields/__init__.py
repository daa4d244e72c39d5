"""Fields of points: displacement, strain, and what smooths them, each with its uncertainty."""
