"""Classical fits: polynomials by least squares."""
