"""The population of the gears and each gear in it."""
