"""Touches from measurements: start, Levenberg-Marquardt, count, and what is believed."""
