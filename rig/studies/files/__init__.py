"""Files that were changed: what is read of them, refused, or taken in silence."""
