"""A virtual test rig whose physics is not that of the library."""
