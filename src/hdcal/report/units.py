"""Units in which parameters are shown; by themselves, as `check` needs no more."""

# Name -> (unit for people, factor from code units).
UNITS: dict[str, tuple[str, float]] = {
    "K": ("1", 1.0),
    "E0": ("GPa", 1e-3),
    "alpha": ("1/K", 1.0),
    "force_offset": ("N", 1.0),
    "deformation_offset": ("mm", 1.0),
    "sigma": ("N", 1.0),
    "force_gain": ("%", 100.0),
    "deformation_gain": ("%", 100.0),
    "temperature_offset": ("K", 1.0),
    "run_offset_sd": ("N", 1.0),
    "specimen_sd": ("1", 1.0),
    "gap_sd": ("N", 1.0),
    "gap_length": ("1", 1.0),
    "noise_correlation": ("1", 1.0),
    "mass": ("kg", 1e3),
    "damping_ratio": ("1", 1.0),
    "initial_deformation": ("mm", 1.0),
    "initial_velocity": ("mm/s", 1.0),
    "deformation_sigma": ("mm", 1.0),
}
