"""A gear that is pulled has the mirrored answers of one that is pressed."""

import json
import subprocess
from pathlib import Path

import pytest
from commands import MAIN, XB1, Done, Hdcal
from short import SHORT, options

pytestmark = [pytest.mark.usefixtures("undrawn"), pytest.mark.thorough]


@pytest.fixture(scope="module")
def runs(hdcal: Hdcal, calibrated: tuple[Done, Path], tmp_path_factory) -> list[Path]:
    """The bundled gear calibrated, and with the sign of every reading changed."""
    folder = tmp_path_factory.mktemp("pulled")
    header, *rows = (XB1 / "data.csv").read_text("utf-8").splitlines()
    changed = [",".join(f"-{cell}" for cell in row.split(",")) for row in rows]
    (folder / "data.csv").write_text("\n".join([header, *changed]) + "\n", "utf-8")
    (folder / "gear.toml").write_bytes((XB1 / "gear.toml").read_bytes())
    done = hdcal("calibrate", folder, *options(SHORT), "--out", folder / "result")
    assert done.returncode == 0, done.stdout + done.stderr
    return [calibrated[1], folder / "result"]


@pytest.mark.parametrize(("limit", "enough"), [(70, False), (120, True)])
def test_the_margin_is_mirrored(here: Hdcal, runs: list[Path], limit: int, enough):
    found = []
    for sign, run in zip(("", "-"), runs, strict=True):
        asked = [f"--deformation={sign}0.4", f"--limit-force={sign}{limit}"]
        done = here("margin", run, *asked, f"--given-force={sign}80", "--json")
        assert done.returncode == 0, done.stderr
        found.append(json.loads(done.stdout))
    for each in found:
        # Below three over the effective number of draws nothing is resolved.
        risk = each["worst"]["exceedance"]["probability"]
        assert risk < 0.02 if enough else risk > 0.98
    # Two short runs of the sampler differ by tenths of a newton.
    pressed, pulled = (each["worst"] for each in found)
    for one, other, sign in (
        ("capacity_N", "capacity_N", 1.0),
        ("lower_bound_N", "upper_bound_N", -1.0),
    ):
        assert pulled[one] == pytest.approx(sign * pressed[other], rel=0.01)
    pressed, pulled = (each["reached"]["median_mm"] for each in found)
    assert pulled == pytest.approx(-pressed, rel=0.01)


def test_a_stream_of_pulls_alarms_at_a_change(runs: list[Path]):
    lines = [
        {"deformation_mm": -at, "force_N": -stiffness * at}
        for stiffness in (198.0, 150.0)
        for at in (0.1, 0.2, 0.3, 0.4, 0.5) * 3
    ]
    done = subprocess.run(
        [*MAIN, "track", str(runs[1])],
        input="".join(json.dumps(line) + "\n" for line in lines),
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert all(found["tested"] for found in answers)
    assert answers[14]["force_N"]["predicted"] == pytest.approx(-99.0, rel=0.05)
    assert not any(found["alarm"] for found in answers[:15])
    assert any(found["alarm"] for found in answers[15:])
