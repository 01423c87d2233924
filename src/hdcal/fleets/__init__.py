"""Stiffness of many gears, and detection of outliers."""
