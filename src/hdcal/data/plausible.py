"""What numbers can be, whatever the rig: one wide range for everything that is given.

A number beyond its range is a slip of the pen or of the unit; no honest rig, however
large or small, comes near the ends. The documentation lists this table.
"""

from typing import Any, NamedTuple

from hdcal.errors import Finding, quoted


class Range(NamedTuple):
    """What a quantity can be."""

    low: float
    high: float
    unit: str
    why: str
    inner: bool = False  # whether the ends themselves are out
    written: tuple[float, str] | None = None  # factor to another unit, and that unit

    @property
    def whole(self) -> bool:
        """Whether it counts something: its ends are integers."""
        return isinstance(self.low, int)

    def holds(self, number: float) -> bool:
        """Tell whether a number is one of this quantity; NaN is none."""
        if self.inner:
            return self.low < number < self.high
        return self.low <= number <= self.high

    def problem(self) -> str:
        """Return in words what is wrong with any other number."""
        factor, unit = self.written or (1, self.unit)
        ends = f"{self.low * factor:.15g} and {self.high * factor:.15g} {unit}".rstrip()
        return f"does not lie between {ends}: {self.why}"

    def shown(self, number: float) -> str:
        """Return a number with its unit, as people write it."""
        factor, unit = self.written or (1, self.unit)
        try:
            return f"{number * factor:.6g} {unit}".rstrip()
        except OverflowError:
            return f"a number of more than 300 digits {unit}".rstrip()


_SCATTER = "at most the largest force"
_STEEL = "from soft gels to ten times diamond"
_CAPACITY = "from the smallest to the largest load cells"
_MASS = "from 1 ng to 1,000,000 t"
RANGES = {
    # readings
    "deformation": Range(-1e5, 1e5, "mm", "no test rig is 200 m long"),
    "force": Range(-1e9, 1e9, "N", "no testing machine reaches it"),
    "temperature": Range(
        -273.15, 3e3, "°C", "absolute zero to the boiling point of steel"
    ),
    "time": Range(-1e12, 1e12, "s", "about 30,000 years"),
    "angle": Range(-1e9, 1e9, "rad", "about 160 million turns"),
    "torque": Range(-1e9, 1e9, "N·m", "no testing machine reaches it"),
    "force_sd": Range(0.0, 1e9, "N", _SCATTER),
    # what a calibration certificate of a gauge states
    "expanded_percent": Range(1e-6, 20.0, "%", "certified gauges are more exact"),
    "expanded_K": Range(1e-6, 50.0, "K", "certified gauges are more exact"),
    "k": Range(1.0, 5.0, "", "the usual coverage factors"),
    # the gear and its priors
    "size": Range(1e-6, 1e5, "mm", "from 1 nm to 100 m"),
    "force_resolution": Range(1e-15, 1e9, "N", _SCATTER),
    "load_cell_capacity": Range(1e-3, 1e9, "N", _CAPACITY),
    "filter": Range(1e-6, 1e9, "Hz", "the bandwidth of any gauge"),
    "K": Range(1e-6, 1e6, "", "1e-6 to 1e6 times the theory"),
    "spring_stiffness": Range(1e-12, 1e12, "N/mm", "the stiffness of any part"),
    "E0": Range(1e-6, 1e7, "MPa", _STEEL),
    "alpha": Range(-1.0, 1.0, "1/K", "no material loses all stiffness in 1 K"),
    "sigma": Range(1e-15, 1e9, "N", _SCATTER),
    "correlation": Range(0.0, 1.0, "", "0: independent, 1: equal"),
    "specimen_sd": Range(1e-9, 1e3, "", "up to 1000 times the stiffness"),
    "gap_length": Range(1e-6, 1e6, "", "1e-6 to 1e6 times the tested range"),
    "mass": Range(1e-15, 1e6, "N·s²/mm", _MASS, written=(1e3, "kg")),
    "damping_ratio": Range(1e-9, 1e3, "", "the damping of any structure"),
    "initial_velocity": Range(-1e9, 1e9, "mm/s", "far above the speed of sound"),
    "deformation_sigma": Range(1e-15, 1e3, "mm", "up to 1 m"),
    "poisson": Range(0.0, 0.5, "", "the limits of an isotropic solid", inner=True),
    "density": Range(1e-13, 1e-6, "N·s²/mm⁴", "from gases to beyond any metal"),
    "cte": Range(-1.0, 1.0, "1/K", "no material doubles its length in 1 K"),
    "yield_strength": Range(1e-6, 1e7, "MPa", _STEEL),
    "effect": Range(-1e15, 1e15, "", "any parameter of an effect, in N, mm, s"),
    "log_sd": Range(1e-9, 100.0, "", "up to a factor of exp(100)"),
    "beta": Range(1e-6, 1e9, "", "any shape that is not a single value"),
    # what is asked
    "share": Range(0.0, 1.0, "", "more than 0 and less than 1", inner=True),
    "limit_stress": Range(1e-6, 1e7, "MPa", _STEEL),
    "tolerance": Range(0.0, 1e5, "mm", "up to 100 m"),
    "setting_sd": Range(0.0, 1e3, "mm", "up to 1 m"),
    "duration": Range(1e-9, 1e9, "s", "from 1 ns to 30 years"),
    "damping": Range(0.0, 1e9, "N·s/mm", "the damping of any structure"),
    # how it is computed
    "points": Range(2, 100_001, "", "a curve needs 2, a figure shows no more"),
    "gears": Range(20, 10_000, "", "fewer show no scatter, more take hours"),
    "chains": Range(2, 64, "", "one cannot be checked, more add nothing"),
    "warmup": Range(1, 1_000_000, "", "more take days"),
    "draws": Range(4, 1_000_000, "", "fewer cannot be checked, more take days"),
    "seed": Range(0, 2**32 - 1, "", "32 bits"),
    "jobs": Range(1, 256, "", "processes of one machine"),
    "degree": Range(1, 9, "", "higher degrees have large rounding errors"),
    "alarm_rows": Range(10.0, 1e9, "", "noise alarms sooner, more is no alarm"),
}
# Parameters, keys of files and options that are such a quantity under another name.
NAMES = {
    name: quantity
    for quantity, names in {
        "deformation": "at window deformation_offset initial_deformation",
        "force": "limit_force given_force amplitude force_offset",
        "sigma": "run_offset_sd gap_sd force_tolerance",
        "temperature": "temperatures reference_temperature",
        "size": "wall_thickness radius length load_height nominal_deformation "
        "gauge_range displacement_pitch",
        "force_resolution": "expanded_N",
        "deformation_sigma": "expanded_mm",
        "share": "content confidence probability interval",
        "correlation": "noise_correlation",
        "tolerance": "tolerances",
        "degree": "degrees",
        "K": "mass_ratio",
        "alpha": "spring_alpha",
        "E0": "spring_modulus",
    }.items()
    for name in names.split()
}


def range_of(name: str) -> Range:
    """Return the range of a quantity, or of a parameter that is one."""
    return RANGES[NAMES.get(name, name)]


def implausible(name: str, given: Any, quantity: str = "") -> list[Finding]:
    """Return a finding where a number, or one of several, is beyond its range."""
    return out_of_range(name, given, range_of(quantity or name))


def out_of_range(name: str, given: Any, known: Range) -> list[Finding]:
    """Return a finding as `implausible` does, of a range that is known."""
    numbers: Any = given
    if hasattr(given, "ravel"):  # NumPy, without importing it
        # Of millions these say enough; each is NaN where one is.
        numbers = [given.min().item(), given.max().item()] if given.size else []
    elif not isinstance(given, list | tuple):
        numbers = [] if given is None else [given]
    for number in numbers:
        if isinstance(number, str):
            return [Finding(name, f"{quoted(number)} is not a number", "Give a number")]
        if not known.holds(number):
            words = f"{known.shown(number)} {known.problem()}"
            unit = " and its unit" if known.unit else ""
            return [Finding(name, words, f"Check the number{unit}")]
        if known.whole and number != int(number):
            words = f"{known.shown(number)} is not a whole number"
            return [Finding(name, words, "Give a whole number")]
    return []
