"""Shipped data are found in a checkout, and when hdcal is imported from a zip."""

import subprocess
import sys
import zipfile
from pathlib import Path

import hdcal.errors
from hdcal.data.resources import datasets_folder, priors_folder


def test_in_a_checkout():
    assert (priors_folder() / "rig.toml").is_file()
    assert (datasets_folder() / "xb1-100-80" / "data.csv").is_file()


def test_from_a_zip(tmp_path):
    package = Path(hdcal.errors.__file__).parent
    archive = tmp_path / "hdcal.zip"
    with zipfile.ZipFile(archive, "w") as target:
        target.writestr("hdcal/__init__.py", "")
        target.write(package / "errors.py", "hdcal/errors.py")
        for folder in ("data", "screening"):
            for source in package.joinpath(folder).rglob("*.py"):
                target.write(source, f"hdcal/{source.relative_to(package)}")
        for source in Path(str(priors_folder())).glob("*.toml"):
            target.write(source, f"hdcal/_data/priors/{source.name}")
    code = (
        f"import sys; sys.path.insert(0, {str(archive)!r})\n"
        "from hdcal.data import priors, resources\n"
        "assert '.zip' in str(resources.priors_folder())\n"
        "assert priors.material_priors('steel')['E0'].numbers[0] == 206e3\n"
        "try: resources.datasets_folder()\n"
        "except FileNotFoundError: print('found')\n"
    )
    run = [sys.executable, "-I", "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout == "found\n", done.stderr
