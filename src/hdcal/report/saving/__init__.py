"""Results on disk: each appears whole or not at all, and replaces nothing of others."""
