"""The plate as it is on its bench: in vibration modes, with what its description lacks."""
