"""Correlation of subsets: reference, normal equations, Gauss-Newton, and a status a point."""
