"""Web applications beside the live loop: serving, and who may come in."""
