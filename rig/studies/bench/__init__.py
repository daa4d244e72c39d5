"""The bench on an emulated camera and display."""
