"""Motion of a gear under a force: its response, and calibration from a record."""
