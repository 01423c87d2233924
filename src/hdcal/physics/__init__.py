"""The force model: pure JAX functions and pytrees, no files and no samplers."""
