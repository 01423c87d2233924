"""Seeded attacks: what strangers may hand over, as files, lines and options."""

import io
import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import click
from commands import XB1
from mutations import damaged_bytes, damaged_data, damaged_text
from posteriors import single

from hdcal.__main__ import hdcal

WORDS = [
    *(
        "",
        " ",
        "0",
        "-0",
        "1",
        "-1",
        "0.3",
        "1e-300",
        "1e308",
        "-1e308",
        "1e999",
        "nan",
    ),
    *(
        "inf",
        "0x1p3",
        "9" * 5000,
        "1_000",
        "１",
        "²",
        "1,5",
        "+1E 2",
        "é" * 3000,
        "'x'",
    ),
    *("data.csv", "gear.toml", ".", "..", "/", "/dev/zero", "/dev/null", "/proc/self"),
    *("\n", "\x1b[2J", "\u202e", "-", "--", "=1+1", "ring", "cup", "hysteresis", "a=b"),
    *("0:0.5:0.1", "0:1e9:1e-9", "[]", "{}", "null", "20°C", "60GPa", "dB", "mm", "%s"),
]
CELLS = [*WORDS, '"', '"1', "1;2", "\t", "\r", "\x00", "NA", "9" * 400, "1e-320"]
HEADERS = [
    *(
        "deformation_mm",
        "force_N",
        "force_kgf",
        "time_s",
        "run",
        "specimen",
        "angle_deg",
    ),
    *("temperature_K", "force_sd_N", "force_dB", "deformation_mm/N", "x", " " * 50_000),
]
NUMBERS = [
    *("0", "-0.0", "1", "-1", "2", "0.3", "-0.25", "1e-3", "1e-9", "1e3", "1e6", "1e9"),
    *("1e30", "-1e30", "1e300", "1e-300", "0.999", "37.8", "20", "-273", "-274", "1e4"),
]
PRIORS = [
    "K",
    "E0",
    "alpha",
    "sigma",
    "force_offset",
    "gap_sd",
    "hysteresis.width",
    "x",
]
LAWS = [
    f"{{ family = '{family}', {one} = {number}, {other} = {size}, unit = '{unit}' }}"
    for family, one, other in [
        *(("normal", "mean", "sd"), ("lognormal", "median", "log_sd")),
        *(("uniform", "low", "high"), ("beta", "a", "b"), ("fixed", "value", "x")),
    ]
    for number in NUMBERS
    for size in ("1", "0", "1e-9", "1e9", "-1")
    for unit in ("1", "mm", "GPa", "N", "1/K", "dB")
]
VALUES = [
    *('"x"', '"steel"', "[]", "{}", "[[1], [2]]", "1979-05-27", "true", "nan", "-inf"),
    *("1e308", "0x10", "-1", "0", "1e-320", '"../x.toml"', '"\\u0000"', "'''x\ny'''"),
    *("{ family = 'normal', mean = 1, sd = 1 }", "{ family = 'fixed', value = 1e300 }"),
    *("{ family = 'beta', a = 0, b = 2, unit = 'mm' }", "{ a.b.c = 1 }", "9" * 400),
]
READING = {"deformation_mm": 0.2, "force_N": 37.8, "temperature_C": 20.0, "run": "a"}
# What a few milliseconds can answer; other commands are named a case that is none.
QUICK = ("check", "fit", "effects", "predict")


def make_targets(folder: Path) -> None:
    """Write whole inputs of every kind, each to be spoiled in a copy."""
    shutil.copytree(XB1, folder / "case")
    single(size=40).save(folder / "posterior.nc")


def _mostly(rng: random.Random) -> bool:
    """Say whether to be mild: what is refused at the door never gets inside."""
    return rng.random() < 0.7


def attack_table(rng: random.Random, targets: Path) -> list[str]:
    """Spoil a table of readings."""
    text = (targets / "case/data.csv").read_text()
    lines = [line.split(",") for line in text.splitlines()]
    mild = _mostly(rng)
    for _ in range(1 if mild else 4):
        line = rng.choice([0, *range(len(lines))])
        place = rng.randrange(len(lines[line]))
        new = rng.choice(HEADERS if line == 0 else NUMBERS if mild else CELLS)
        lines[line][place : place + (1 if mild else rng.randrange(3))] = [new]
        if mild and line == 0 and _mostly(rng):
            # A column more, of numbers that may be anything.
            header = ["deformation_mm", "force_N", new]
            own = rng.choice(NUMBERS)
            rest = [
                [*one, rng.choice([own, f"{k}"])] for k, one in enumerate(lines[1:])
            ]
            lines = [header, *rest]
    separator, end = (",", "\n") if mild else rng.choice([",;", "\t\n", "|\x85", ",\r"])
    raw = end.join(separator.join(cells) for cells in lines).encode("utf-8", "replace")
    shutil.copytree(targets / "case", "case")
    whole = raw if mild else damaged_bytes(raw, rng)
    Path("case/data.csv").write_bytes(whole)
    return [rng.choice(["check", "fit"]), "case"]


def attack_gear(rng: random.Random, targets: Path) -> list[str]:
    """Spoil a gear file."""
    lines = (targets / "case/gear.toml").read_text().splitlines()
    mild = _mostly(rng)
    for _ in range(1 if mild else 3):
        line = rng.choice([k for k, one in enumerate(lines) if "=" in one])
        key = lines[line].partition("=")[0].strip()
        new = [f"{key} = {rng.choice(NUMBERS if mild else VALUES)}"]
        if not mild:
            new += [f"[{key}]", f"{key}.x = 1", "", f"priors.{key} = 1"]
        lines[line] = rng.choice(new)
    if mild and _mostly(rng):
        lines += ["[priors]", f"{rng.choice(PRIORS)} = {rng.choice(LAWS)}"]
    raw = "\n".join(lines).encode()
    shutil.copytree(targets / "case", "case")
    Path("case/gear.toml").write_bytes(raw if mild else damaged_bytes(raw, rng))
    return ["check", "case"]


def attack_posterior(rng: random.Random, targets: Path) -> list[str]:
    """Damage the bytes of a posterior."""
    raw = (targets / "posterior.nc").read_bytes()
    Path("posterior.nc").write_bytes(damaged_bytes(raw, rng))
    return ["predict", "posterior.nc", "--deformation", "0.3", "--json"]


def without_a_force(answer: str) -> bool:
    """Say whether a prediction holds a band without its numbers."""
    columns = json.loads(answer)["columns"]
    bands = (name for name in columns if name.startswith(("physics", "new")))
    return any(None in columns[name] for name in bands)


def attack_lines(rng: random.Random, targets: Path) -> list[str]:
    """Spoil a stream of readings."""
    lines = []
    for _ in range(10):
        plain = READING | {"time_s": rng.random()}
        damaged = json.dumps(damaged_data(plain, rng)), damaged_text(plain, rng)
        lines.append(rng.choice([json.dumps(plain), *damaged]).encode())
    if rng.random() < 0.3:
        lines.append(damaged_bytes(json.dumps(READING).encode(), rng))
    Path("lines").write_bytes(b"\n".join(lines) + b"\n")
    return ["track", str(targets / "posterior.nc")]


def attack_options(rng: random.Random, targets: Path) -> list[str]:
    """Give a command any words for any of its options."""
    name = rng.choice([*hdcal.commands, *QUICK * 4])
    arguments, command = [name], hdcal.commands[name]
    if isinstance(command, click.Group):
        arguments.append(rng.choice(list(command.commands)))
        command = command.commands[arguments[-1]]
    takes = any(isinstance(one, click.Argument) for one in command.params)
    if takes:
        place = "posterior.nc" if name == "predict" else "case"
        arguments.append(str(targets / place) if name in QUICK else "none-such")
    known = [one for one in command.params if isinstance(one, click.Option)]
    for _ in range(rng.choice([1, 2, 4])):
        one = rng.choice(known)
        arguments.append(rng.choice(one.opts))
        if not one.is_flag:
            arguments.append(rng.choice(WORDS if rng.random() < 0.3 else NUMBERS))
    if not _mostly(rng):
        arguments.append(rng.choice(WORDS))
    return [argument.replace("\x00", "") for argument in arguments]


# How to spoil, and what share of all attacks.
ATTACKS: dict[str, tuple[Callable[[random.Random, Path], list[str]], float]] = {
    "table": (attack_table, 0.3),
    "gear": (attack_gear, 0.3),
    "options": (attack_options, 0.2),
    "lines": (attack_lines, 0.1),
    "posterior": (attack_posterior, 0.1),
}


def standard_input() -> io.TextIOWrapper:
    """Return the stream of readings that an attack left, or an empty one."""
    lines = Path("lines")
    data = lines.read_bytes() if lines.exists() else b""
    return io.TextIOWrapper(io.BytesIO(data))
