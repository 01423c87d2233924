"""Margins: what force a deformation needs, for how many of whom, how surely."""
