"""What a camera would see: speckle, camera, light and sensor, with exact truth."""
