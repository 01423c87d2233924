"""`hdcal blind` and its commands."""
