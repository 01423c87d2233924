"""Seeded attacks: what strangers may hand over, as files, lines and options."""

import io
import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import click
import h5py
from commands import XB1
from mutations import RAW, damaged_bytes, damaged_data, damaged_text
from posteriors import single
from sealing import sealed_set

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
VALUES = [
    *('"x"', '"steel"', "[]", "{}", "[[1], [2]]", "1979-05-27", "true", "nan", "-inf"),
    *("1e308", "0x10", "-1", "0", "1e-320", '"../x.toml"', '"\\u0000"', "'''x\ny'''"),
    *("{ family = 'normal', mean = 1, sd = 1 }", "{ family = 'fixed', value = 1e300 }"),
    *("{ family = 'beta', a = 0, b = 2, unit = 'mm' }", "{ a.b.c = 1 }", "9" * 400),
]
READING = {"deformation_mm": 0.2, "force_N": 37.8, "temperature_C": 20.0, "run": "a"}
# What a few milliseconds can answer; other commands are named a case that is none.
QUICK = ("check", "fit", "effects", "audit")


def make_targets(folder: Path) -> None:
    """Write whole inputs of every kind, each to be spoiled in a copy."""
    shutil.copytree(XB1, folder / "case")
    single(size=40).save(folder / "posterior.nc")
    sealed_set(folder / "set", count=2)


def attack_table(rng: random.Random, targets: Path) -> list[str]:
    """Spoil a table of readings."""
    text = (targets / "case/data.csv").read_text()
    lines = [line.split(",") for line in text.splitlines()]
    for _ in range(rng.choice([1, 1, 2, 5])):
        line = rng.choice([0, rng.randrange(len(lines))])
        place = rng.randrange(len(lines[line]) + 1)
        new = rng.choice(HEADERS if line == 0 else CELLS)
        lines[line][place : place + rng.randrange(3)] = [new]
    separator, end = rng.choice(",,,;\t|"), rng.choice(["\n", "\n", "\r\n", "\x85"])
    raw = end.join(separator.join(cells) for cells in lines).encode("utf-8", "replace")
    shutil.copytree(targets / "case", "case")
    whole = raw if rng.random() < 0.7 else damaged_bytes(raw, rng)
    Path("case/data.csv").write_bytes(whole)
    return [rng.choice(["check", "fit"]), "case"]


def attack_gear(rng: random.Random, targets: Path) -> list[str]:
    """Spoil a gear file."""
    lines = (targets / "case/gear.toml").read_text().splitlines()
    for _ in range(rng.choice([1, 1, 2, 5])):
        line = rng.randrange(len(lines))
        key = lines[line].partition("=")[0].strip() or "priors.K"
        new = [f"{key} = {rng.choice(VALUES)}", f"[{key}]", f"{key}.x = 1", ""]
        lines[line : line + rng.randrange(2)] = [rng.choice(new)]
    raw = "\n".join(lines).encode()
    shutil.copytree(targets / "case", "case")
    whole = raw if rng.random() < 0.7 else damaged_bytes(raw, rng)
    Path("case/gear.toml").write_bytes(whole)
    return ["check", "case"]


def attack_posterior(rng: random.Random, targets: Path) -> list[str]:
    """Spoil a posterior: its bytes, or what its variables and attributes are."""
    file = Path("posterior.nc")
    shutil.copy(targets / "posterior.nc", file)
    if rng.random() < 0.4:
        file.write_bytes(damaged_bytes(file.read_bytes(), rng))
    else:
        with h5py.File(file, "r+") as tree:
            found: list[str] = []
            tree.visit(found.append)
            _spoil(rng, tree, rng.choice(found))
    return ["predict", str(file), "--deformation", "0.3", "--json"]


def _spoil(rng: random.Random, tree: h5py.File, name: str) -> None:
    one = tree[name]
    match rng.randrange(5):
        case 0:
            del tree[name]
        case 1:
            del tree[name]
            tree[name] = rng.choice([1, "x", [1.0, float("nan")], [[[0]]], b"\xff"])
        case 2 if isinstance(one, h5py.Dataset) and one.dtype.kind == "f":
            one[...] = rng.choice([float("nan"), float("inf"), 0.0, -1.0, 1e308])
        case 3:
            tree[f"{name}/more" if isinstance(one, h5py.Group) else "more"] = one
        case _:
            key = rng.choice([*one.attrs, *tree.attrs, "units"])
            tree.attrs[key] = rng.choice(["x", "{}", "[1, 2]", 7, b"\xff", *RAW[:3]])


def attack_set(rng: random.Random, targets: Path) -> list[str]:
    """Spoil a sealed set, before it is answered or opened."""
    shutil.copytree(targets / "set", "set")
    shutil.copy(targets / "set.key", "set.key")
    file = rng.choice([path for path in Path("set").rglob("*") if path.is_file()])
    if file.suffix == ".json" and rng.random() < 0.7:
        plain = json.loads(file.read_text())
        spoiled = json.dumps(damaged_data(plain, rng))
        file.write_text(spoiled if rng.random() < 0.7 else damaged_text(plain, rng))
    else:
        file.write_bytes(damaged_bytes(file.read_bytes(), rng))
    ways = [["answer", "set", "--by", "none"], ["open", "set", "--key", "set.key"]]
    return ["blind", *rng.choice(ways)]


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
    return ["track", "--gear", str(targets / "case/gear.toml")]


def attack_options(rng: random.Random, targets: Path) -> list[str]:
    """Give a command any words for any of its options."""
    name = rng.choice([*hdcal.commands, *QUICK, *QUICK])
    command = hdcal.commands[name]
    if isinstance(command, click.Group):
        inner = rng.choice(list(command.commands))
        arguments, command = [name, inner], command.commands[inner]
    else:
        arguments = [name]
    arguments.append(str(targets / "case") if name in QUICK else "none-such")
    known = [one for p in command.params for one in p.opts if one.startswith("-")]
    for _ in range(rng.choice([1, 2, 4])):
        arguments.append(rng.choice([*known, *known, *WORDS]))
        if rng.random() < 0.8:
            arguments.append(rng.choice(WORDS))
    return [argument.replace("\x00", "") for argument in arguments]


# How to spoil, and what share of all attacks.
ATTACKS: dict[str, tuple[Callable[[random.Random, Path], list[str]], float]] = {
    "table": (attack_table, 0.3),
    "gear": (attack_gear, 0.3),
    "options": (attack_options, 0.2),
    "lines": (attack_lines, 0.1),
    "posterior": (attack_posterior, 0.05),
    "set": (attack_set, 0.05),
}


def standard_input() -> io.TextIOWrapper:
    """Return the stream of readings that an attack left, or an empty one."""
    lines = Path("lines")
    data = lines.read_bytes() if lines.exists() else b""
    return io.TextIOWrapper(io.BytesIO(data))
