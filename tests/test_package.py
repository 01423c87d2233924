"""The wheel works away from this checkout, and no file names a machine."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hdcal.data.resources import pages

ROOT = Path(__file__).parents[1]

FOREIGN = {
    "a path of one machine": r"(?<![\w.~/-])/(?:work|farm|root|home|Users)/\w",
    "a temporary path": r"(?<![\w.])/tmp/\w",
    "the address of a package index": r"https?://[^\s<>]*(?:pypi|pythonhosted|npm)",
    "an option naming an index": r"^\s*-(?:i |f |-[a-z-]*index|-find-links|-trusted)",
}

LIST_PRIORS = """
import hdcal
from hdcal.data.resources import pages, priors_folder

print(hdcal.__file__)
print(*sorted(entry.name for entry in priors_folder().iterdir()))
print(*pages())
"""


def run(*command: str | Path, **options) -> str:
    """Run a command that has to succeed, and return what it prints."""
    done = subprocess.run(command, capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def shipped(folder: str) -> set[str]:
    """Return the files below a top-level folder, as paths from the root."""
    files = (path for path in (ROOT / folder).rglob("*") if path.is_file())
    names = {path.relative_to(ROOT).as_posix() for path in files}
    return {name for name in names if "/__pycache__/" not in name}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the sdist, and from nothing but the sdist the wheel."""
    out = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT)
    (built,) = out.glob("*.whl")
    return built


def test_the_wheel_holds_package_and_data_and_nothing_else(wheel: Path):
    names = {*zipfile.ZipFile(wheel).namelist()}
    data = {f"hdcal/_data/{n}" for f in ("priors", "datasets") for n in shipped(f)}
    code = {name.removeprefix("src/") for name in shipped("src")}
    assert data and code and data | code <= names
    tops = {name.split("/")[0] for name in names}
    assert tops == {"hdcal", f"{'-'.join(wheel.name.split('-')[:2])}.dist-info"}


@pytest.mark.parametrize("form", ["installed", "wheel"])
def test_data_are_found_away_from_the_checkout(form: str, wheel: Path, tmp_path: Path):
    # A wheel on the path is imported as a zip: no file of it exists on disk.
    place = wheel
    if form == "installed":
        place = tmp_path / "installed"
        options = ["--quiet", "--no-deps", "--no-index", "--target", place]
        run(sys.executable, "-m", "pip", "install", *options, wheel)
    environment = {**os.environ, "PYTHONPATH": str(place)}
    listed = run(sys.executable, "-c", LIST_PRIORS, cwd=tmp_path, env=environment)
    file, priors, topics = listed.splitlines()
    assert file.startswith(str(place))
    assert {*priors.split()} == {Path(name).name for name in shipped("priors")}
    assert topics.split() == list(pages())


def test_no_file_names_a_machine_or_a_package_index():
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
    )
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    patterns = {what: re.compile(rule, re.M) for what, rule in FOREIGN.items()}
    found = []
    for name in filter(None, listed.stdout.decode().split("\0")):
        path = ROOT / name
        content = path.read_bytes() if path.is_file() else b""
        if b"\0" not in content:
            text = content.decode("utf-8", "replace")
            found += [
                f"{name}: {what}" for what, p in patterns.items() if p.search(text)
            ]
    assert not found, "\n".join(found)
