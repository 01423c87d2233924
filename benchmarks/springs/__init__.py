"""Simulated springs of all scales with the faults of real records."""
