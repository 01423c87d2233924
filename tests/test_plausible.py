"""Every number that is given has one range, and is refused just outside it."""

from collections.abc import Callable, Iterator
from dataclasses import replace
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
from hdcal.data.case import Case
from hdcal.data.findings import FileFindings
from hdcal.data.gear import read_gear
from hdcal.data.measurements.force_table import read_columns
from hdcal.data.measurements.measurements import read_measurements
from hdcal.data.plausible import NAMES, RANGES, Range, implausible, range_of
from hdcal.data.tables.headers import DIMENSIONS
from hdcal.data.units import unit_names
from hdcal.errors import InputError

GEAR = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40\nlength_mm = 70\n"
MATERIAL = """
E0 = {{ family = "fixed", value = {E0!r}, unit = "MPa" }}
alpha = {{ family = "fixed", value = {alpha!r}, unit = "1/K" }}
poisson = {{ family = "fixed", value = {poisson!r} }}
density = {{ family = "fixed", value = {density!r} }}
cte = {{ family = "fixed", value = {cte!r} }}
yield_strength = {{ family = "fixed", value = {yield_strength!r} }}
"""
STEEL = {"E0": 2e5, "alpha": 3e-4, "poisson": 0.3, "density": 7.8e-9}
STEEL |= {"cte": 1e-5, "yield_strength": 800.0}
UNITS = {"E0": "MPa", "alpha": "1/K", "mass": "N*s^2/mm"}


@pytest.fixture(scope="module")
def posterior():
    return still_posterior(K=0.02)


def own_header(quantity: str) -> str:
    return f"{quantity}_{unit_names(DIMENSIONS[quantity])[0]}"


def column(quantity: str, value, folder: Path) -> None:
    """Read a table with one such cell."""
    header = own_header(quantity)
    rest = [own_header(name) for name in ("deformation", "force")]
    others = [name for name in rest if name != header]
    rows = [f"{value!r},{','.join(['0'] * len(others))}\n" for _ in range(6)]
    (folder / "data.csv").write_text(",".join([header, *others]) + "\n" + "".join(rows))
    if quantity == "torque":
        with FileFindings("data.csv") as findings:
            read_columns(
                folder / "data.csv",
                None,
                findings,
                quantities=("torque",),
                required=("torque",),
            )
    read_measurements(folder / "data.csv")


def gear_key(key: str, value, folder: Path) -> None:
    """Read a gear file with one such number."""
    name = key.rpartition(".")[2]
    kept = [line for line in GEAR.splitlines() if not line.startswith(f"{name} ")]
    table = "" if key.startswith("gear.") else f"[{key.rpartition('.')[0]}]\n"
    (folder / "gear.toml").write_text("\n".join([*kept, f"{table}{name} = {value!r}"]))
    read_gear(folder / "gear.toml")


def prior(
    key: str, value, folder: Path, family="fixed", size="value", rest="", gear=""
) -> None:
    """Read a gear file with one such prior."""
    name = key.rpartition(".")[2]
    unit = f', unit = "{UNITS[name]}"' if name in UNITS else ""
    entry = f'{key} = {{ family = "{family}", {size} = {value!r}{rest}{unit} }}'
    (folder / "gear.toml").write_text(f"{GEAR}{gear}[priors]\n{entry}\n")
    read_gear(folder / "gear.toml")


def material(name: str, value, folder: Path) -> None:
    """Read a material file with one such number."""
    (folder / "my.toml").write_text(MATERIAL.format(**{**STEEL, name: value}))
    (folder / "gear.toml").write_text(GEAR + 'material = "my.toml"\n')
    read_gear(folder / "gear.toml")


def read_entries() -> Iterator[tuple[str, str, Callable]]:
    """Yield the quantity, how a finding names it, and what reads it from a file."""
    for name in DIMENSIONS:
        yield name, own_header(name), partial(column, name)
    sizes = ("wall_thickness", "radius", "length", "load_height", "nominal_deformation")
    for key in [
        *(f"gear.{name}_mm" for name in sizes),
        *("measurement.reference_temperature_C", "measurement.force_resolution_N"),
        *("rig.load_cell_capacity_N", "rig.gauge_range_mm"),
        *("rig.displacement_pitch_mm", "rig.filter_Hz"),
    ]:
        name = key.rpartition(".")[2].rpartition("_")[0]
        yield NAMES.get(name, name), key, partial(gear_key, key)
    stated = {"force": ("percent", "N"), "deformation": ("mm",), "temperature": ("K",)}
    for gauge, units in stated.items():
        table = f"measurement.{gauge}_calibration"
        for name in ("k", *(f"expanded_{unit}" for unit in units)):
            key = f"{table}.{name}"
            yield NAMES.get(name, name), key, partial(gear_key, key)
    for name in STEEL:
        yield name, f"{name}.value", partial(material, name)
    for name in (
        *("K", "E0", "alpha", "force_offset", "deformation_offset", "sigma"),
        *("run_offset_sd", "specimen_sd", "gap_sd", "gap_length", "mass"),
        *("damping_ratio", "initial_deformation", "initial_velocity"),
        *("deformation_sigma", "noise_correlation"),
    ):
        place = f"priors.{name}.value"
        yield NAMES.get(name, name), place, partial(prior, name)
    spring = partial(prior, "K", gear='theory = "spring"\n')
    yield "spring_stiffness", "priors.K.value", spring
    effect = "seating_slack.clearance"
    yield "effect", f"priors.{effect}.value", partial(prior, effect)
    spread = {"family": "lognormal", "size": "log_sd", "rest": ", median = 2.0"}
    yield "log_sd", "priors.K.log_sd", partial(prior, "K", **spread)
    shape = {"family": "beta", "rest": ", b = 1.0"}
    yield "beta", f"priors.{effect}.a", partial(prior, effect, size="a", **shape)


def _falling(case: Case) -> Case:
    """Return a case whose force falls, which nobody diagnoses."""
    records = case.records
    return replace(case, records=replace(records, force=-records.force))


# Each call is refused for another reason as well, so that nothing is computed where the
# number is plausible: what counts is only whether the number is named too.
ASKED: list[tuple[Callable, dict, tuple[str, ...]]] = [
    (
        lambda run, **asked: hdcal.margin(run, **{"deformation": 0.4, **asked}),
        {"direction": "sideways"},
        (
            *("deformation", "limit_force", "given_force", "temperature", "content"),
            *("confidence", "required_probability", "seed", "tolerances"),
        ),
    ),
    (
        lambda run, **asked: hdcal.predict(run, **{"deformation": 0.4, **asked}),
        {"direction": "sideways"},
        ("deformation", "temperature", "interval", "seed"),
    ),
    (
        hdcal.inverse_design,
        {"vary": {}, "materials": (), "limit_force": 70.0, "deformation": 0.4},
        (
            *("limit_force", "limit_stress", "probability", "deformation"),
            *("temperatures", "vary"),
        ),
    ),
    (
        hdcal.wave_generator,
        {"window": (0.3, 0.4), "tolerances": {"colour_mm": 1.0}},
        ("window", "setting_sd", "rates", "temperatures", "probability"),
    ),
    (
        hdcal.wave_generator,
        {"window": (0.4, 0.3)},
        ("tolerances",),
    ),
    (
        hdcal.study,
        {"vary": {"radius_mm": [38.0]}, "materials": ["stel"]},
        ("deformation", "temperature", "interval", "vary"),
    ),
    (
        hdcal.respond,
        {"force": "push"},
        ("amplitude", "duration", "points", "mass", "damping", "draws", "seed"),
    ),
    (hdcal.respond, {"force": "sine", "draws": 1}, ("frequency",)),
    (
        lambda run, **asked: hdcal.calibrate(run.case, **asked),
        {"effects": ["nothing"]},
        ("chains", "warmup", "draws", "seed"),
    ),
    (
        lambda run, **asked: hdcal.calibrate_dynamic(run.case, **asked),
        {},
        ("chains", "warmup", "draws", "seed"),
    ),
    (
        lambda run, **asked: hdcal.Tracker(run, **{"reopen": -1.0, **asked}),
        {},
        ("alarm_rows", "reopen"),
    ),
    (
        lambda run, **asked: hdcal.fit(run.case, **asked),
        {},
        ("degrees", "at"),
    ),
    (
        lambda run, **asked: hdcal.causes(run.case, **{"seed": -1, **asked}),
        {},
        ("jobs",),
    ),
    (lambda run, seed: hdcal.diagnose(_falling(run.case), seed=seed), {}, ("seed",)),
]
SEVERAL = {
    "tolerances": lambda v: {"radius_mm": v},
    "temperatures": lambda v: [20.0, v],
    "temperature": lambda v: v,
    "degrees": lambda v: [v],
    "window": lambda v: (v, 0.4),
    "rates": lambda v: (v, 1.0),
    "vary": lambda v: {"radius_mm": (v, 40.0)},
}


def asked_entries() -> Iterator[tuple[str, str, Callable]]:
    """Yield the quantity, its parameter, and what asks with it."""
    for function, other, names in ASKED:
        for name in names:
            quantity = {"vary": "size"}.get(name, name)
            if function is hdcal.respond and name == "draws":
                quantity = "gears"

            def ask(value, run, function=function, other=other, name=name):
                given = SEVERAL.get(name, lambda v: v)(value)
                return function(run, **{**other, name: given})

            yield NAMES.get(quantity, quantity), name, ask


def named_as_beyond(ask: Callable) -> set[str]:
    """Return what is refused for lying outside its range."""
    try:
        ask()
    except InputError as error:
        wrong = [f for f in error.findings if "does not lie between" in f.problem]
        assert all(f.remedy for f in wrong)
        return {f.column or f.file for f in wrong}
    return set()


def ends(known: Range) -> tuple[list, list]:
    """Return numbers at the ends of a range, and those just outside."""
    low, high = known.low, known.high
    if isinstance(low, int):
        return [low, high], [low - 1, high + 1]
    below = low - 1e-6 * (abs(low) or 1.0)
    above = high + 1e-6 * (abs(high) or 1.0)
    if known.inner:
        return [low + 1e-9, high - 1e-9], [low, high, below, above]
    return [low, high], [below, above]


READ, ASK = list(read_entries()), list(asked_entries())


@pytest.mark.parametrize("entry", READ, ids=[place for _, place, _ in READ])
def test_what_a_file_gives_is_refused_just_outside_its_range(entry, tmp_path: Path):
    quantity, place, read = entry
    inside, outside = ends(RANGES[quantity])
    for value in inside:
        assert place not in named_as_beyond(partial(read, value, tmp_path)), value
    for value in outside:
        # A negative size of a prior is refused for its sign already.
        if value <= 0.0 and place.startswith(("priors.", *STEEL)):
            with pytest.raises(InputError):
                read(value, tmp_path)
            continue
        assert place in named_as_beyond(partial(read, value, tmp_path)), value


@pytest.mark.parametrize("entry", ASK, ids=[place for _, place, _ in ASK])
def test_what_is_asked_is_refused_just_outside_its_range(entry, posterior):
    quantity, name, ask = entry
    inside, outside = ends(RANGES[quantity])
    for value in inside if quantity != "seed" else [1]:
        assert name not in named_as_beyond(partial(ask, value, posterior)), value
    for value in outside:
        assert name in named_as_beyond(partial(ask, value, posterior)), value


def test_every_range_is_used():
    used = {quantity for quantity, _, _ in (*READ, *ASK)}
    assert used | {"share"} == RANGES.keys()


def options(command: click.Command) -> Iterator[tuple[str, click.Parameter]]:
    """Yield every option of a program that takes numbers."""
    if isinstance(command, click.Group):
        for below in command.commands.values():
            yield from options(below)
        return
    for option in command.params:
        kind = option.type
        number = isinstance(kind, Parsed | click.types.IntParamType)
        number |= isinstance(kind, click.types.FloatParamType)
        # A second check would be said before all others, and alone.
        assert not isinstance(kind, click.IntRange | click.FloatRange)
        if number:
            yield f"{command.name} {option.opts[0]}", option


NUMBERS = dict(options(program))


@pytest.mark.parametrize("name", NUMBERS)
def test_every_option_that_takes_a_number_has_a_range(name: str):
    assert len(NUMBERS) > 35
    assert range_of(str(NUMBERS[name].name)).why


def test_numbers_beyond_any_computer_are_refused():
    for value in (10**400, -(10**5000), float("inf")):
        with pytest.raises(InputError, match="does not lie between"):
            hdcal.calibrate(hdcal.read_case(XB1), seed=value)


@pytest.mark.parametrize("given", [[{"force_N": 1.0}], np.ones((5, 2)), 3])
def test_what_is_no_table_is_told(given):
    with pytest.raises(InputError, match="Give a path, a DataFrame, or arrays"):
        hdcal.read_case(given)


def test_a_text_is_no_number():
    assert "'a' is no number" in str(InputError(implausible("seed", "a")))
