"""Designs: sizes that keep limits, springs of wave generators, parameter studies."""

# Sizes that may be varied [mm], and what else a study may vary.
SIZE_NAMES = ("wall_thickness_mm", "radius_mm", "length_mm", "load_height_mm")
AXES = (*SIZE_NAMES, "deformation_mm", "temperature_C")
