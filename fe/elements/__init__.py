"""Bicubic Hermite elements on a grid: mesh, functions, quadrature, functionals and factors."""
