"""The field net: learned on drawn fields, it corrects the adaptive field and its σ."""
