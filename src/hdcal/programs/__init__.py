"""Compiled functions that start fast: traced once, kept, and loaded ahead."""
