"""Touches from strain and from the whole pattern, against their bound."""
