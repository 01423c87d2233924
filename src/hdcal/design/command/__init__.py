"""`hdcal design` and its options."""
