"""Damaged files, lines and options: an answer or a finding, soon, and nothing else."""

import io
import json
import os
import random
import resource
import shutil
import sys
import time
from itertools import pairwise
from pathlib import Path

import click
import numpy as np
import pytest
from commands import XB1, Hdcal
from posteriors import single

from hdcal.__main__ import hdcal

INPUTS, CHUNKS, SLICE = int(os.environ.get("HDCAL_ATTACKS", "100000")), 20, 8
# For one input, and for a process that has read thousands of them.
MOST_SECONDS, MOST_KIB = 10.0, 2 * 1024**2
NUMBERS = [
    *("0", "-0.0", "1", "-1", "0.3", "-0.25", "1e-3", "1e-9", "1e3", "1e9", "0x10"),
    *("-1e30", "1e300", "1e-300", "1e999", "nan", "inf", "37.8", "-274", "9" * 400),
]
WORDS = [
    *("", " ", "1,5", "1_000", "１", "²", "é" * 3000, "'x'", '"', "1;2", "\t", "\x00"),
    *("data.csv", ".", "..", "/", "/dev/zero", "/dev/null", "\n", "\x1b[2J", "\u202e"),
    *("-", "--", "=1+1", "ring", "hysteresis", "a=b", "0:0.5:0.1", "[]", "{}", "null"),
    *("20°C", "dB", "%s", "[[1], [2]]", '"\\u0000"', "1979-05-27", "true"),
    *("{ family = 'normal', mean = 1, sd = 1 }", "{ family = 'fixed', value = 1e9 }"),
    *("{ family = 'beta', a = 0, b = 2, unit = 'mm' }", "{ a.b.c = 1 }", "[" * 900),
]
HEADERS = [
    *("deformation_mm", "force_N", "force_kgf", "time_s", "run", "specimen", "x"),
    *("temperature_K", "force_sd_N", "force_dB", "deformation_mm/N", " " * 50_000),
]
PRIORS = ["K", "E0", "alpha", "sigma", "force_offset", "gap_sd", "hysteresis.width"]
READING = {"deformation_mm": 0.2, "force_N": 37.8, "temperature_C": 20.0, "run": "a"}
# Commands that a few milliseconds can answer; others get a case that does not exist.
QUICK = ("check", "fit", "effects", "predict")


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Return bytes with one kind of damage."""
    place = rng.randrange(len(data) + 1)
    end = place + rng.choice([1, 10, 1000])
    return rng.choice(
        [
            data[:place],
            data[:place] + data[end:],
            data[:end] + data[place:],
            data[:place] + rng.randbytes(5) + data[place:],
            b"\xef\xbb\xbf" + data,
            b"[" + data,
            bytes(len(data)),
            data.decode("utf-8", "replace").encode("utf-16"),
        ]
    )


def write(path: str, text: str, rng: random.Random) -> None:
    """Write a file, in one case of three damaged."""
    raw = text.encode("utf-8", "replace")
    Path(path).write_bytes(damaged(raw, rng) if rng.random() < 0.3 else raw)


def attack_table(rng: random.Random, targets: Path) -> list[str]:
    """Change cells, headers and separators of a table."""
    text = (targets / "case/data.csv").read_text()
    lines = [line.split(",") for line in text.splitlines()]
    for _ in range(rng.choice([1, 1, 1, 4])):
        line = rng.choice([0, *range(len(lines))])
        new = rng.choice(HEADERS if line == 0 else NUMBERS + WORDS)
        place = rng.randrange(len(lines[line]))
        lines[line][place : place + rng.randrange(2)] = [new]
    separator, end = rng.choice([",\n"] * 4 + [",;", "\t\n", "|\x85", ",\r"])
    shutil.copytree(targets / "case", "case")
    write("case/data.csv", end.join(map(separator.join, lines)), rng)
    return [rng.choice(["check", "fit"]), "case"]


def attack_gear(rng: random.Random, targets: Path) -> list[str]:
    """Change values, tables and priors of a gear file."""
    lines = (targets / "case/gear.toml").read_text().splitlines()
    for _ in range(rng.choice([1, 1, 3])):
        line = rng.choice([k for k, text in enumerate(lines) if "=" in text])
        key = lines[line].partition("=")[0].strip()
        new = [f"{key} = {rng.choice(NUMBERS + WORDS)}"] * 4
        lines[line] = rng.choice([*new, f"[{key}]", "", f"priors.{key} = 1"])
    if rng.random() < 0.5:
        family, one, other = rng.choice(
            [
                *(("normal", "mean", "sd"), ("lognormal", "median", "log_sd")),
                *(("uniform", "low", "high"), ("beta", "a", "b")),
                ("fixed", "value", "x"),
            ]
        )
        unit = rng.choice(["1", "mm", "GPa", "N", "1/K", "dB"])
        numbers = f"{one} = {rng.choice(NUMBERS)}, {other} = {rng.choice(NUMBERS)}"
        prior = f"{{ family = '{family}', {numbers}, unit = '{unit}' }}"
        lines += ["[priors]", f"{rng.choice(PRIORS)} = {prior}"]
    shutil.copytree(targets / "case", "case")
    write("case/gear.toml", "\n".join(lines), rng)
    return ["check", "case"]


def attack_posterior(rng: random.Random, targets: Path) -> list[str]:
    """Damage the bytes of a posterior."""
    raw = (targets / "posterior.nc").read_bytes()
    Path("posterior.nc").write_bytes(damaged(raw, rng))
    return ["predict", "posterior.nc", "--deformation", "0.3", "--json"]


def attack_lines(rng: random.Random, targets: Path) -> list[str]:
    """Damage the readings of a stream."""
    values = [None, True, -1, 1e308, 10**400, "", "x", "\ud800", [], {}, [[]], "0.2"]
    lines = []
    for _ in range(10):
        reading = READING | {"time_s": rng.random()}
        reading[rng.choice([*READING, "more"])] = rng.choice(values)
        text = json.dumps(reading)
        raw = rng.choice(["NaN", "-Infinity", "9" * 6000, "[" * 100_000, "tru"])
        lines.append(rng.choice([text, text, text.replace("0.2", raw)]).encode())
    lines.append(damaged(json.dumps(READING).encode(), rng))
    Path("lines").write_bytes(b"\n".join(lines) + b"\n")
    return ["track", str(targets / "posterior.nc")]


def attack_options(rng: random.Random, targets: Path) -> list[str]:
    """Give a command any text for any of its options."""
    name = rng.choice([*hdcal.commands, *QUICK * 4])
    arguments, command = [name], hdcal.commands[name]
    if any(isinstance(each, click.Argument) for each in command.params):
        place = "posterior.nc" if name == "predict" else "case"
        arguments.append(str(targets / place) if name in QUICK else "none-such")
    known = [each for each in command.params if isinstance(each, click.Option)]
    for option in rng.choices(known, k=rng.choice([1, 2, 4])):
        arguments.append(rng.choice(option.opts))
        if not option.is_flag:
            arguments.append(rng.choice(WORDS if rng.random() < 0.3 else NUMBERS))
    if rng.random() < 0.3:
        arguments.append(rng.choice(WORDS))
    return [argument.replace("\x00", "") for argument in arguments]


# Kinds of attacks, and their shares of all.
ATTACKS = {
    "table": (attack_table, 0.3),
    "gear": (attack_gear, 0.3),
    "options": (attack_options, 0.2),
    "lines": (attack_lines, 0.1),
    "posterior": (attack_posterior, 0.1),
}


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of valid inputs."""
    folder = tmp_path_factory.mktemp("targets")
    shutil.copytree(XB1, folder / "case")
    single(size=40).save(folder / "posterior.nc")
    return folder


def bands_without_numbers(answer: str) -> bool:
    columns = json.loads(answer)["columns"]
    bands = (name for name in columns if name.startswith(("physics", "new")))
    return any(None in columns[name] for name in bands)


def wrong(here: Hdcal, kind: str, seed: int, targets: Path) -> str | None:
    """Attack once; return what is wrong with the outcome, or None."""
    rng = random.Random(f"{kind} {seed}")
    arguments = ATTACKS[kind][0](rng, targets)
    before, began, lines = {*Path().rglob("*")}, time.monotonic(), Path("lines")
    raw = lines.read_bytes() if lines.exists() else b""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(raw)))
        done = here(*arguments)
    seconds, printed = time.monotonic() - began, done.stdout + done.stderr
    new = {*Path().rglob("*")} - before
    reasons = {
        "an internal error": "internal error" in printed or "Traceback" in printed,
        f"exit code {done.returncode}": done.returncode not in (0, 1, 2),
        "no message": done.returncode != 0 and not printed.strip(),
        "a message of many pages": len(done.stderr) > 20_000,
        f"{seconds:.1f} s": seconds > MOST_SECONDS,
        f"written: {sorted(map(str, new))[:3]}": done.returncode == 2 and bool(new),
        "a band without numbers": kind == "posterior"
        and done.returncode == 0
        and bands_without_numbers(done.stdout),
    }
    found = [reason for reason, so in reasons.items() if so]
    return f"{kind} {seed}: {found} {arguments} {printed[-500:]}" if found else None


def chunks() -> list:
    """Return a short range of seeds, and long ones for `make attacks`."""
    ends = np.linspace(0, INPUTS, CHUNKS + 1).astype(int)
    slow = [range(1_000_000 + a, 1_000_000 + b) for a, b in pairwise(ends)]
    return [
        range(SLICE),
        *(pytest.param(each, marks=pytest.mark.slow) for each in slow),
    ]


@pytest.mark.parametrize("seeds", chunks())
@pytest.mark.parametrize("kind", ATTACKS)
def test_an_attack_is_answered_or_refused(here: Hdcal, targets, kind, seeds):
    found = []
    share = 1.0 if len(seeds) == SLICE else ATTACKS[kind][1]
    for seed in seeds[: round(share * len(seeds))]:
        for path in Path().iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        found.append(wrong(here, kind, seed, targets))
    assert not any(found), [each for each in found if each]
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < MOST_KIB
