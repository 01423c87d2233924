"""The article behind the example data, held against its own formula and readings."""
