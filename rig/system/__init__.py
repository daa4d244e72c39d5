"""What all rooms stand on: cache, processes, frames, timing, optional packages."""
