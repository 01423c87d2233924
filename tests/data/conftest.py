"""A good case on disk, to be spoiled by the tests."""

from pathlib import Path

import pytest

GEAR = """\
[gear]
name = "XB1"
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "steel"
[measurement]
deformation = "radial"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a good gear.toml and a good data.csv."""
    (tmp_path / "gear.toml").write_text(GEAR)
    rows = "".join(f"{i / 10},{20 * i}\n" for i in range(6))
    (tmp_path / "data.csv").write_text("deformation_mm,force_N\n" + rows)
    return tmp_path
