"""Readings of many gears, and the faults of their records."""
