"""Charts as declarations, and what draws them."""
