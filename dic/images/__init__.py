"""Images: read, checked, interpolated between their pixels, and judged as a pattern."""
