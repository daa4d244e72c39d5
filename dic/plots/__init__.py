"""Fields drawn over their image."""
