"""Plate mechanics: plate and touches in; displacement and strain out."""
