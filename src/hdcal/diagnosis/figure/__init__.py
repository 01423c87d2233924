"""Figures of a diagnosis: where, which and how far."""
