"""What the projector can show for those who watch; each demo is a value that goes on by a frame."""
