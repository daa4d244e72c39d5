"""From nothing to a calibrated bench, step by step; left and resumed at any of them."""
