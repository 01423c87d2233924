"""From a file of pulls to every answer: nothing is called enough that is not."""

import json
import subprocess
from pathlib import Path

import pytest
from commands import MAIN, XB1, Done, Hdcal
from short import SHORT, options

# Two short runs of the sampler: their forces differ by tenths of a newton.
NEAR = {"rel": 0.01}

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def runs(
    hdcal: Hdcal,
    calibrated: tuple[Done, Path],
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, Path]:
    """The bundled gear calibrated, and with the sign of every reading turned."""
    folder = tmp_path_factory.mktemp("pulled")
    header, *rows = (XB1 / "data.csv").read_text("utf-8").splitlines()
    turned = [",".join(f"-{cell}" for cell in row.split(",")) for row in rows]
    (folder / "data.csv").write_text("\n".join([header, *turned]) + "\n", "utf-8")
    (folder / "gear.toml").write_bytes((XB1 / "gear.toml").read_bytes())
    done = hdcal("calibrate", folder, *options(SHORT), "--out", folder / "result")
    assert done.returncode == 0, done.stdout + done.stderr
    return {"": calibrated[1], "-": folder / "result"}


@pytest.mark.thorough
def test_every_answer_is_mirrored(here: Hdcal, runs: dict[str, Path], tmp_path: Path):
    def both(command: str, *asked: str) -> list[dict]:
        """Return the answers of both, where ± is the sign of each."""
        answers = []
        for sign, run in runs.items():
            given = [text.replace("±", sign) for text in asked]
            # Files of each command once; a margin of other limits has the same.
            out = tmp_path / f"{command}{sign}"
            given += [] if out.exists() else ["--out", str(out)]
            done = here(command, run, *given, "--json")
            assert done.returncode == 0, done.stderr
            answers.append(json.loads(done.stdout))
        return answers

    at = "--deformation=±0.4"
    for limit, enough in (("70", False), ("±70", False), ("120", True), ("±120", True)):
        pair = both("margin", at, f"--limit-force={limit}", "--given-force=±80")
        for found in pair:
            assert ("is not enough" in found["headline"]) != enough
            risk = found["worst"]["exceedance"]["probability"]
            # Not resolved below three over the effective number of draws.
            assert risk < 0.02 if enough else risk > 0.98
            sure = found["worst"]["exceedance"]["at_confidence"]
            assert sure < 1e-3 if enough else sure > 0.999
        pressed, pulled = (found["worst"] for found in pair)
        assert pulled["capacity_N"] == pytest.approx(pressed["capacity_N"], **NEAR)
        assert pulled["lower_bound_N"] == pytest.approx(
            -pressed["upper_bound_N"], **NEAR
        )
        pressed, pulled = (found["reached"]["median_mm"] for found in pair)
        assert pulled == pytest.approx(-pressed, **NEAR)
    vary = "--vary=wall_thickness_mm=0.5:0.8"
    pressed, pulled = both("design", "--limit-force=±70", at, vary)
    assert pulled["design"]["force_kept_N"] == pytest.approx(-70.0, rel=1e-5)
    wall = pressed["design"]["sizes_mm"]["wall_thickness"]
    assert pulled["design"]["sizes_mm"]["wall_thickness"] == pytest.approx(wall, **NEAR)
    pressed, pulled = both("study", at, "--vary=radius_mm=38,40,42")
    force = [-value for value in pressed["columns"]["force_hi_N"]]
    assert pulled["columns"]["force_lo_N"] == pytest.approx(force, **NEAR)
    pressed, pulled = both("respond", "--force=step", "--amplitude=±40", "--points=101")
    peaks = [found["estimates"]["peak_mm"]["median"] for found in (pressed, pulled)]
    # Mass and damping are drawn from priors, not in the same order of stiffness.
    assert peaks[1] == pytest.approx(peaks[0], rel=0.05)
    assert min(pulled["columns"]["deformation_lo_mm"]) < -0.3
    assert pulled["tested_share"] > 0.0


@pytest.mark.thorough
def test_a_window_that_is_pulled_has_its_spring(here: Hdcal, runs: dict[str, Path]):
    springs = []
    for sign, window in (("", "0.35:0.45"), ("-", "-0.45:-0.35")):
        asked = ["--tolerance", "wall_thickness_mm=0.04", f"--window={window}"]
        done = here("design", runs[sign], *asked, "--out", f"spring{sign}", "--json")
        assert done.returncode == 0, done.stderr
        springs.append(json.loads(done.stdout)["spring"])
    pressed, pulled = springs
    # What is counted among draws is known to a percent or so.
    assert pulled["rate_N_per_mm"] == pytest.approx(pressed["rate_N_per_mm"], rel=0.2)
    assert pulled["interference_mm"] == pytest.approx(
        -pressed["interference_mm"], rel=0.1
    )


@pytest.mark.thorough
def test_a_stream_of_pulls_alarms_at_a_change(runs: dict[str, Path]):
    lines = [
        {"deformation_mm": -at, "force_N": -stiffness * at}
        for stiffness in (198.0, 150.0)
        for at in (0.1, 0.2, 0.3, 0.4, 0.5) * 3
    ]
    done = subprocess.run(
        [*MAIN, "track", str(runs["-"])],
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


@pytest.mark.thorough
def test_a_capacity_of_the_other_sign_names_its_option(here: Hdcal, runs, tmp_path):
    asked = ["--deformation", "0.4", "--limit-force", "-70"]
    done = here("margin", runs[""], *asked, "--out", "result")
    assert done.returncode == 2 and list(tmp_path.iterdir()) == []
    said = " ".join(done.stderr.split())
    assert "--limit-force: -70 N is no limit of the force at 0.4 mm" in said
    assert "Give 70 N, or ask at a negative deformation" in said
