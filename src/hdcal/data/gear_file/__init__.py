"""The gear file: TOML, its schema, and the priors that it states."""
