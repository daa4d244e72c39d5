"""Fields whose window the data choose, from tile sums and blocks of polynomials."""
