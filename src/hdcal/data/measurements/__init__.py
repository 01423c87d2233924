"""From tables of cells to a case: units, checks, labels, screening."""
