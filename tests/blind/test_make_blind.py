"""`make blind` goes through all steps once, goes on, and replaces nothing."""

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from commands import ROOT

# Writes what the real one would, and what it was asked for.
HDCAL = """#!/bin/sh
echo "$*" >> asked
case "$2" in
    make) mkdir blind-check && touch blind-check.key ;;
    answer) test ! -e broken && touch "blind-check/answers-$5.json" ;;
    open) touch blind-check/opened.json ;;
esac
"""
MADE = "blind make --cases 400 --mix all --out blind-check"
ANSWERED = [
    f"blind answer blind-check --by {name} --jobs 2"
    for name in ("hdcal", "bic", "r2", "none")
]
OPENED = "blind open blind-check --key blind-check.key"

Make = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Run make where everything is set up and hdcal only writes empty files."""
    shutil.copy(ROOT / "Makefile", tmp_path)
    command = tmp_path / "bin" / "hdcal"
    command.parent.mkdir()
    command.write_text(HDCAL)
    command.chmod(0o755)
    (tmp_path / ".venv").mkdir()
    for name in ("requirements.lock", "pyproject.toml", ".venv/installed"):
        (tmp_path / name).touch()
    # The tests may themselves be run by make, whose options are not meant here.
    clean = {k: v for k, v in os.environ.items() if not k.startswith("MAKE")}

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        given = ["make", "BIN=bin", *arguments]
        return subprocess.run(
            given,
            cwd=tmp_path,
            env={k: v for k, v in clean.items() if k not in ("CASES", "WORKERS")},
            capture_output=True,
            text=True,
            timeout=60,
        )

    return run


def asked(folder: Path) -> list[str]:
    """Return what hdcal was asked for."""
    return (folder / "asked").read_text().splitlines()


def test_all_steps_are_gone_through(make: Make, tmp_path: Path):
    done = make("blind")
    assert done.returncode == 0, done.stdout + done.stderr
    assert asked(tmp_path) == [MADE, *ANSWERED, OPENED]


def test_an_interrupted_check_goes_on(make: Make, tmp_path: Path):
    (tmp_path / "broken").touch()
    assert make("blind").returncode != 0
    assert asked(tmp_path) == [MADE, ANSWERED[0]]
    (tmp_path / "broken").unlink()
    assert make("blind").returncode == 0
    assert asked(tmp_path)[2:] == [*ANSWERED, OPENED]


def test_an_opened_check_is_neither_replaced_nor_answered_again(
    make: Make, tmp_path: Path
):
    assert make("blind", "CASES=5", "WORKERS=1").returncode == 0
    before = asked(tmp_path)
    assert "--cases 5" in before[0] and before[1].endswith("--jobs 1")
    done = make("blind")
    assert done.returncode != 0 and "blind-check.key" in done.stdout
    assert asked(tmp_path) == before
    for name in ("src", "tests", "benchmarks", "examples", "docs"):
        (tmp_path / name).mkdir()
    assert make("clean").returncode == 0
    assert not list(tmp_path.glob("blind-check*"))
