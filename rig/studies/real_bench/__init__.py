"""The bench as it is: what a scene does not say, before and after presses."""
