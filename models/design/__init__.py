"""What a bench can reach: Cramér-Rao bounds, expected errors, calibration by presses."""
