"""The plate in time: modes that ring, forces that change between frames, and material that creeps."""
