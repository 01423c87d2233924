"""Tables of any source: one grid of cells, its headers, its columns and numbers."""
