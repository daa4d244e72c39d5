"""The plate as it is on its bench, in a hundred vibration modes and in what its description lacks."""
