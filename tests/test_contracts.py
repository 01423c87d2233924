"""The import contracts hold, and each of them catches the import that it is for."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CONTRACTS = {
    contract["id"]: contract
    for contract in tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"][
        "importlinter"
    ]["contracts"]
}

# contract -> (module that sins, what it imports); one entry for every contract
VIOLATIONS = {
    "rooms": ("data/records.py", "import hdcal.physics.chain"),
    "blind": ("blind/answer.py", "import hdcal.design.sizes"),
    "shared_causes": ("shared_causes/summary.py", "import hdcal.design.sizes"),
    "diagnosis": ("diagnosis/library.py", "import hdcal.tracking.tracker"),
    "engine": (
        "prediction/engine/mixture.py",
        "import hdcal.prediction.margin.result",
    ),
    "calibration": ("calibration/summary.py", "import hdcal.classical.fit.fit"),
    "moving": ("motion/summary.py", "import hdcal.classical.fit.fit"),
    "virtual_rig": ("blind/virtual_rig/paths.py", "import hdcal.physics.theory"),
    "physics": ("physics/chain.py", "import xarray"),
    "numpyro": ("data/records.py", "import numpyro.distributions"),
    "diffrax": ("inference/model.py", "import diffrax"),
    "pint": ("data/records.py", "import pint"),
    "pydantic": ("inference/__init__.py", "import pydantic"),
    "pandas": ("inference/__init__.py", "import pandas"),
    "matplotlib": ("data/records.py", "import matplotlib.pyplot"),
    "click": ("data/records.py", "import click"),
    "root": ("physics/chain.py", "from hdcal import InputError"),
}


def lint(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run import-linter on the package in `folder`/src."""
    script = "import sys; from importlinter.cli import lint_imports_command as c; c()"
    return subprocess.run(
        [sys.executable, "-c", script, "--no-cache", *options],
        cwd=folder,
        # Wide enough for the longest name of a contract on one line.
        env={**os.environ, "PYTHONPATH": str(folder / "src"), "COLUMNS": "200"},
        capture_output=True,
        text=True,
    )


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Return a copy of the package and its contracts, free to be spoiled."""
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=ignore)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def test_the_package_keeps_every_contract():
    result = lint(ROOT)
    assert result.returncode == 0, result.stdout + result.stderr
    assert f"Contracts: {len(CONTRACTS)} kept, 0 broken." in result.stdout


def test_every_contract_has_a_violation_to_catch():
    assert VIOLATIONS.keys() == CONTRACTS.keys()


@pytest.mark.parametrize("contract", VIOLATIONS)
def test_a_planted_import_breaks_its_contract(contract: str, tree: Path):
    module, statement = VIOLATIONS[contract]
    path = tree / "src" / "hdcal" / module
    path.write_text(f"{path.read_text('utf-8')}\n{statement}\n", "utf-8")
    result = lint(tree, "--contract", contract)
    assert result.returncode == 1, result.stdout + result.stderr
    assert "Contracts: 0 kept, 1 broken." in result.stdout
    assert f"{CONTRACTS[contract]['name']} BROKEN" in result.stdout


def test_a_module_in_no_room_breaks_the_rooms(tree: Path):
    (tree / "src" / "hdcal" / "attic.py").write_text('"""In no room."""\n', "utf-8")
    result = lint(tree, "--contract", "rooms")
    assert result.returncode == 1, result.stdout + result.stderr
    assert "attic" in result.stdout


def layers() -> list[list[str]]:
    """Return the rooms from the top down; several in one layer know no other."""
    return [layer.split(" | ") for layer in CONTRACTS["rooms"]["layers"]]


def forbidden() -> list[tuple[str, str]]:
    """Return every pair of rooms of which the first must not import the second."""
    return [
        (room, other)
        for depth, layer in enumerate(layers())
        for room in layer
        for other in [r for above in layers()[: depth + 1] for r in above]
        if room not in (other, "__main__")
    ]


def test_every_edge_that_points_up_or_across_is_caught(tree: Path):
    pairs = forbidden()
    assert len(pairs) > 80
    for room, other in pairs:
        folder = tree / "src" / "hdcal" / room
        path = folder / "planted.py" if folder.is_dir() else folder.with_suffix(".py")
        before = path.read_text("utf-8") if path.exists() else '"""Planted."""\n'
        path.write_text(f"{before}import hdcal.{other}\n", "utf-8")
    result = lint(tree, "--contract", "rooms")
    assert result.returncode == 1, result.stdout + result.stderr
    said = " ".join(result.stdout.split())
    for room, other in pairs:
        words = f"hdcal.{room} is not allowed to import hdcal.{other}:"
        assert words in said, words
