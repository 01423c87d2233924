"""Closed-form evidence of what may be missing from the force model."""
