"""Where frames come from: the twin, its script, a camera, files."""
