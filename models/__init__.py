"""Touches from measurements: forward models, solver, nets, training and scores."""
