"""Every number that is given has a range, and is refused just outside it."""

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import click
import numpy as np
import pytest
from commands import XB1
from moving import still_posterior

import hdcal
from hdcal.__main__ import hdcal as program
from hdcal.cli.option_types import Parsed
from hdcal.data.gear import read_gear
from hdcal.data.measurements.measurements import read_measurements
from hdcal.data.plausible import NAMES, RANGES, implausible, range_of
from hdcal.data.tables.headers import DIMENSIONS
from hdcal.data.units import SIZES
from hdcal.errors import InputError

GEAR = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40\nlength_mm = 70\n"
KEYS = (
    *("gear.wall_thickness_mm", "gear.radius_mm", "gear.length_mm"),
    *("gear.load_height_mm", "gear.nominal_deformation_mm", "rig.filter_Hz"),
    *("measurement.reference_temperature_C", "measurement.force_resolution_N"),
    *("rig.load_cell_capacity_N", "rig.gauge_range_mm", "rig.displacement_pitch_mm"),
    *("measurement.force_calibration.k", "measurement.force_calibration.expanded_N"),
    "measurement.temperature_calibration.expanded_K",
    "measurement.force_calibration.expanded_percent",
)


def quantity_of(key: str) -> str:
    """Return the quantity of a key such as gear.radius_mm or priors.K."""
    name = key.rpartition(".")[2]
    if name not in {*NAMES, *RANGES}:
        name = name.rpartition("_")[0]
    return NAMES.get(name, name)


def header(quantity: str) -> str:
    return f"{quantity}_{next(iter(SIZES[DIMENSIONS[quantity]])).split()[0]}"


def column(quantity: str, value, folder: Path) -> None:
    """Read a table with one such cell."""
    others = ("angle",) if quantity == "torque" else ("deformation", "force")
    names = [header(quantity), *map(header, others)]
    names = [*dict.fromkeys(names)]
    rows = [",".join([repr(value), *["0"] * (len(names) - 1)]) for _ in range(6)]
    file = folder / "data.csv"
    file.write_text("\n".join([",".join(names), *rows]) + "\n")
    read_measurements(file)


def gear_key(key: str, value, folder: Path) -> None:
    """Read a gear file with one such number."""
    table, _, name = key.rpartition(".")
    kept = [line for line in GEAR.splitlines() if not line.startswith(f"{name} ")]
    head = "" if table == "gear" else f"[{table}]\n"
    (folder / "gear.toml").write_text("\n".join([*kept, f"{head}{name} = {value!r}"]))
    read_gear(folder / "gear.toml")


def read_entries() -> Iterator[tuple[str, str, Callable]]:
    """Yield the quantity, the name of its place, and what reads it from a file."""
    for name in DIMENSIONS:
        yield name, header(name), partial(column, name)
    for key in KEYS:
        yield quantity_of(key), key, partial(gear_key, key)


# Each call is refused for another reason as well, so that nothing is computed.
ASKED: list[tuple[Callable, dict, tuple[str, ...]]] = [
    (
        lambda run, **asked: hdcal.margin(run, **{"deformation": 0.4, **asked}),
        {"direction": "sideways"},
        (
            *("deformation", "limit_force", "given_force", "temperature", "content"),
            *("confidence", "seed", "tolerances"),
        ),
    ),
    (
        lambda run, **asked: hdcal.predict(run, **{"deformation": 0.4, **asked}),
        {"direction": "sideways"},
        ("deformation", "temperature", "interval", "seed"),
    ),
    (
        hdcal.inverse_design,
        {"vary": {}, "limit_force": 70.0, "deformation": 0.4},
        (
            *("limit_force", "limit_stress", "probability", "deformation"),
            *("temperatures", "vary"),
        ),
    ),
    (
        hdcal.wave_generator,
        {"window": (0.3, 0.4), "tolerances": {"colour_mm": 1.0}},
        ("window", "setting_sd", "temperatures", "probability"),
    ),
    (hdcal.wave_generator, {"window": (0.4, 0.3)}, ("tolerances",)),
    (
        hdcal.study,
        {"vary": {"wall_thickness_mm": [60.0]}},
        ("deformation", "temperature", "interval", "vary"),
    ),
    (
        hdcal.respond,
        {"force": "push"},
        ("amplitude", "duration", "points", "mass", "damping", "draws", "seed"),
    ),
    (
        lambda run, **asked: hdcal.calibrate(run.case, **asked),
        {"effects": ["nothing"]},
        ("chains", "warmup", "draws", "seed"),
    ),
    (hdcal.Tracker, {}, ("alarm_rows",)),
    (lambda run, **asked: hdcal.fit(run.case, **asked), {}, ("degrees", "at")),
    (lambda run, **a: hdcal.causes(run.case, **{"seed": -1, **a}), {}, ("jobs",)),
]
SEVERAL = {
    "tolerances": lambda v: {"radius_mm": v},
    "temperatures": lambda v: [20.0, v],
    "degrees": lambda v: [v],
    "window": lambda v: (v, 0.4),
    "vary": lambda v: {"radius_mm": (v, 40.0)},
}
READ = [*read_entries()]
CALLS = [(f, other, name) for f, other, names in ASKED for name in names]


def outside_names(call: Callable) -> set[str]:
    """Return the places that are refused for lying outside their ranges."""
    try:
        call()
    except InputError as error:
        wrong = [f for f in error.findings if "does not lie between" in f.problem]
        assert all(f.remedy for f in wrong)
        return {f.column or f.file for f in wrong}
    return set()


def outside(quantity: str) -> list[float]:
    """Return numbers just outside both ends of a range."""
    low, high = RANGES[quantity].low, RANGES[quantity].high
    if isinstance(low, int):
        return [low - 1, high + 1]
    return [low - 1e-6 * (abs(low) or 1.0), high + 1e-6 * (abs(high) or 1.0)]


@pytest.mark.parametrize("entry", READ, ids=[place for _, place, _ in READ])
def test_a_number_of_a_file_is_refused_just_outside_its_range(entry, tmp_path: Path):
    quantity, place, read = entry
    for value in outside(quantity):
        assert place in outside_names(partial(read, value, tmp_path)), value
    high = RANGES[quantity].high
    inside = high - 1e-9 if RANGES[quantity].inner else high
    assert place not in outside_names(partial(read, inside, tmp_path))


def test_a_parameter_is_refused_just_outside_its_range():
    posterior = still_posterior(K=0.02)
    for function, other, name in CALLS:
        quantity = {"vary": "size"}.get(name, NAMES.get(name, name))
        if function is hdcal.respond and name == "draws":
            quantity = "gears"
        given = SEVERAL.get(name, lambda v: v)
        for value in outside(quantity):
            call = partial(function, posterior, **{**other, name: given(value)})
            assert name in outside_names(call), (name, value)


def options(command: click.Command) -> Iterator[click.Parameter]:
    """Yield every option of a program that takes numbers."""
    if isinstance(command, click.Group):
        for below in command.commands.values():
            yield from options(below)
        return
    numbers = (Parsed, click.types.IntParamType, click.types.FloatParamType)
    for option in command.params:
        # A range of click would be checked before all others, and alone.
        assert not isinstance(option.type, click.IntRange | click.FloatRange)
        if isinstance(option.type, numbers):
            yield option


def test_every_option_that_takes_a_number_has_a_range():
    found = [*options(program)]
    assert len(found) > 35
    # Sizes of a gear are named as keys of the gear file.
    names = [re.sub("_(mm|C)$", "", str(option.name)) for option in found]
    assert all(range_of(name).why for name in names)


def test_what_is_no_number_or_no_table_is_refused():
    for value in (10**400, -(10**5000), float("inf")):
        with pytest.raises(InputError, match="does not lie between"):
            hdcal.calibrate(hdcal.read_case(XB1), seed=value)
    for given in ([{"force_N": 1.0}], np.ones((5, 2)), 3):
        with pytest.raises(InputError, match="Give a path, a DataFrame, or arrays"):
            hdcal.read_case(given)
    assert "'a' is not a number" in str(InputError(implausible("seed", "a")))
