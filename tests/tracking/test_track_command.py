"""`hdcal track` answers every line at once, a bad one with what is wrong."""

import io
import json
import math
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from commands import MAIN, Hdcal
from posteriors import plain_draws, ramp_case, single, written_posterior

from hdcal.quantities import TORQUE
from hdcal.tracking.stream import csv_reader, json_reader
from hdcal.tracking.tracker import Tracker

GOOD = b'{"deformation_mm": 0.2, "force_N": 37.8}'
BAD = [
    b"0.2, 37.8",
    b"\xff\xfe",
    b"[" * 60_000,
    b'{"deformation_mm": 0.2}',
    b'{"deformation_mm": "0.2", "force_N": 1}',
    b'{"deformation_mm": 0.2, "force_N": 1' + b"0" * 400 + b"}",
    b'{"deformation_mm": 0.2, "force_N": NaN}',
    b'{"deformation_mm": 0.2, "force_N": -1e308}',
    b'{"deformation_mm": 0.2, "force_N": 1, "temperature_C": -300}',
    b" " * 70_000 + GOOD,
]


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> str:
    place = tmp_path_factory.mktemp("track") / "posterior.nc"
    single(size=400).save(place)
    return str(place)


def feed(monkeypatch: pytest.MonkeyPatch, *lines: bytes) -> None:
    stream = io.TextIOWrapper(io.BytesIO(b"\n".join(lines) + b"\n"))
    monkeypatch.setattr(sys, "stdin", stream)


def answers(done) -> list[dict]:
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_a_line_for_every_line_good_or_bad(here: Hdcal, run, monkeypatch):
    huge = b'{"deformation_mm": 0.1, "force_N": 19.0, "x": "' + b"y" * 300_000 + b'"}'
    far = b'{"deformation_mm": 0.9, "force_N": 180}'
    feed(monkeypatch, GOOD, b"", *BAD, huge, far)
    done = here("track", run)
    found = answers(done)
    assert [line["row"] for line in found] == list(range(1, len(BAD) + 4))
    assert {line["schema"] for line in found} == {"hdcal.track/1"}
    assert [line["status"] for line in found[1:-1]] == ["error"] * (len(BAD) + 1)
    assert all(len(line["error"]) < 200 for line in found[1:-1])
    first, last = found[0], found[-1]
    assert (first["status"], first["tested"]) == ("ok", True)
    assert (last["status"], last["tested"]) == ("ok", False)
    low, high = first["stiffness_N_per_mm"]["credible_95"]
    assert 200.0 < low < 205.0 < high < 210.0
    assert done.returncode == 2
    feed(monkeypatch)
    assert (here("track", run).returncode, here("track").returncode) == (0, 2)


@pytest.mark.parametrize(
    "table",
    [
        [b"deformation_mm,force_N,run", b"0.1,19.8,3", b"0.2,x,3", b"0.2,38.9,3"],
        [b"Weg [um];Kraft [kN];run", b"100;0,0198;3", b"200;9", b"200;0,0389;3"],
    ],
)
def test_csv_is_followed_as_its_json_would_be(here: Hdcal, run, monkeypatch, table):
    rows = (
        b'{"deformation_mm": 0.1, "force_N": 19.8, "run": 3}',
        b"no reading",
        b'{"deformation_mm": 0.2, "force_N": 38.9, "run": 3}',
    )
    found = []
    for lines in (table, rows):
        feed(monkeypatch, *lines)
        done = here("track", run)
        assert done.returncode == 2
        found.append(answers(done))
    for of_table, of_rows in zip(*found, strict=True):
        assert of_table["status"] == of_rows["status"]
        if of_rows["status"] == "ok":
            one, two = (
                line["force_N"]["predictive_95"] for line in (of_table, of_rows)
            )
            assert one == pytest.approx(two, rel=1e-9)


def test_a_comma_that_was_decimal_stays_so():
    read = csv_reader(b"Weg [mm];Kraft [N]", single(size=40).case.units)
    assert read is not None and read(b"0,1;19,8").force == 19.8
    with pytest.raises(ValueError, match="decimal point among"):
        read(b"0,2;1.234")


def test_a_torsional_spring_has_keys_and_units_of_its_own(monkeypatch):
    case = replace(ramp_case(), units=TORQUE)
    tracker = Tracker(written_posterior(case, plain_draws(case)))
    line = json_reader(TORQUE)(b'{"angle_rad": 0.2, "torque_N_m": 40.0}')
    read = csv_reader(b"angle_deg,torque_Nmm", TORQUE)
    assert read is not None
    cell = read(b"%.10f,40000" % math.degrees(0.2))
    assert np.allclose([*cell.model_dump().values()][:2], [0.2, 40.0])
    one, two = tracker.follow([line, cell])
    assert one["torque_N_m"]["predicted"] == pytest.approx(40.0, abs=2.0)
    assert one.keys() == two.keys() and "stiffness_N_m_per_rad" in one
    # Forces are no torques.
    assert csv_reader(b"deformation_mm,force_N", TORQUE) is None
    with pytest.raises(ValueError):
        json_reader(TORQUE)(GOOD)


@pytest.mark.thorough
def test_an_answer_comes_before_the_next_line_and_ctrl_c_ends(run):
    with subprocess.Popen(
        [*MAIN, "track", run],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdin and process.stdout and process.stderr
        process.stdin.write(GOOD + b"\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline())["row"] == 1
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 130
        assert b"interrupted after 1 rows" in process.stderr.read()
