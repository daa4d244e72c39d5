"""The plate in time: modes that ring, forces between frames, and material that creeps."""
