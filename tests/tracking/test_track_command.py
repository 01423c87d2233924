"""`hdcal track` answers every line at once, a bad one with what is wrong."""

import io
import json
import signal
import subprocess
import sys
from dataclasses import replace

import pytest
from commands import MAIN, Hdcal
from posteriors import plain_draws, ramp_case, single, written_posterior

from hdcal.quantities import TORQUE
from hdcal.tracking.stream import json_reading
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


def test_a_torsional_spring_has_keys_and_units_of_its_own():
    case = replace(ramp_case(), units=TORQUE)
    tracker, reading = Tracker(written_posterior(case, plain_draws(case))), json_reading
    line = b'{"angle_rad": 0.2, "torque_N_m": 40.0}'
    (answer,) = tracker.follow([reading(TORQUE).model_validate_json(line)])
    assert answer["torque_N_m"]["predicted"] == pytest.approx(40.0, abs=2.0)
    assert "stiffness_N_m_per_rad" in answer
    # Forces are no torques.
    with pytest.raises(ValueError):
        reading(TORQUE).model_validate_json(GOOD)


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
