"""The report: studies that run as programs of their own, and the page made of their figures."""
