"""`hdcal track` answers every line at once, a bad one with what is wrong."""

import io
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from commands import MAIN, XB1, Hdcal

from hdcal.tracking.stream import read_line

GEAR = XB1 / "gear.toml"
GOOD = b'{"deformation_mm": 0.2, "force_N": 37.8}'
BAD = [
    (b"0.2, 37.8", "no JSON"),
    (b"\xff\xfe", "no JSON"),
    (b"[" * 60_000, "no JSON"),
    (b"[0.2, 37.8]", "no object"),
    (b'{"deformation_mm": 0.2}', "force_N missing"),
    (b'{"deformation_um": 200, "force_N": null}', "deformation_mm and force_N missing"),
    (b'{"deformation_mm": "0.2", "force_N": 1}', "deformation_mm is no number"),
    (b'{"deformation_mm": true, "force_N": 1}', "deformation_mm is no number"),
    (b'{"deformation_mm": 0.2, "force_N": 1' + b"0" * 400 + b"}", "force_N is too"),
    (b'{"deformation_mm": 0.2, "force_N": 1, "run": [1]}', "run is no label"),
    (b" " * 70_000 + GOOD, "longer than"),
]


@pytest.mark.thorough
def test_a_wild_reading_is_refused_with_its_reason(hdcal: Hdcal):
    wild = [
        (name, json.dumps({**json.loads(GOOD), name: "?"}).replace('"?"', number))
        for name in ("deformation_mm", "force_N", "temperature_C", "time_s")
        for number in ("1e308", "-1e308", "1e400", "-Infinity")
    ]
    lines = "\n".join([*(line for _, line in wild), GOOD.decode()])
    done = hdcal("track", "--gear", GEAR, input=lines)
    assert done.returncode == 2, done.stderr
    *bad, good = map(json.loads, done.stdout.splitlines())
    for (name, _), found in zip(wild, bad, strict=True):
        assert f"the {name.rpartition('_')[0]} of " in found["error"]
        assert "does not lie between" in found["error"] and ": " in found["error"]
    assert "force of -1e+308 N does not lie between -1000000000 and" in bad[5]["error"]
    assert good["status"] == "ok"


@pytest.mark.parametrize(("line", "words"), BAD)
def test_what_is_no_reading_is_said(line, words):
    with pytest.raises(ValueError, match=words):
        read_line(line)


def test_what_is_no_reading_is_answered_by_one_that_is():
    with pytest.raises(ValueError, match="such as") as refused:
        read_line(b"0.02,4.05")
    example = str(refused.value).partition("such as ")[2]
    assert read_line(example.encode()) == {"deformation": 0.1, "force": 19.8}


def test_a_reading_may_say_more():
    line = (
        b'{"deformation_mm": 0, "force_N": -1, "temperature_C": 20, "run": 3, "x": 1}'
    )
    expected = {"deformation": 0.0, "force": -1.0, "temperature": 20.0, "run": "3"}
    assert read_line(line) == expected


def feed(monkeypatch: pytest.MonkeyPatch, *lines: bytes) -> None:
    stream = io.TextIOWrapper(io.BytesIO(b"\n".join(lines) + b"\n"))
    monkeypatch.setattr(sys, "stdin", stream)


def test_a_line_for_every_line_good_or_bad(here: Hdcal, monkeypatch):
    nan = b'{"deformation_mm": 0.1, "force_N": NaN}'
    huge = b'{"deformation_mm": 0.1, "force_N": 19.0, "x": "' + b"y" * 300_000 + b'"}'
    feed(monkeypatch, GOOD, b"", b"bad", nan, huge, GOOD)
    done = here("track", "--gear", GEAR)
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert [one["row"] for one in answers] == [1, 2, 3, 4, 5]
    assert [one["status"] for one in answers] == ["ok", "error", "error", "error", "ok"]
    assert "longer than" in answers[3]["error"]
    assert {one["schema"] for one in answers} == {"hdcal.track/1"}
    assert done.returncode == 2


@pytest.mark.parametrize(
    "table",
    [
        [b"deformation_mm,force_N,run", b"0.1,19.8,3", b"0.2,x,3", b"0.2,38.9,3"],
        [b"Weg [um];Kraft [kN];run", b"100;0,0198;3", b"200;9", b"200;0,0389;3"],
    ],
)
def test_csv_is_followed_as_its_json_would_be(here: Hdcal, monkeypatch, table):
    answers = []
    rows = (
        b'{"deformation_mm": 0.1, "force_N": 19.8, "run": 3}',
        b"what is no reading",
        b'{"deformation_mm": 0.2, "force_N": 38.9, "run": 3}',
    )
    for lines in (table, rows):
        feed(monkeypatch, *lines)
        done = here("track", "--gear", GEAR)
        assert done.returncode == 2
        # Units are converted to the last digit but one.
        digits = {"parse_float": lambda text: f"{float(text):.9g}"}
        answers.append([json.loads(a, **digits) for a in done.stdout.splitlines()])
    for of_table, of_rows in zip(*answers, strict=True):
        of_table.pop("error", None), of_rows.pop("error", None)
        assert of_table == of_rows


def test_a_comma_that_was_decimal_stays_so(here: Hdcal, monkeypatch):
    feed(monkeypatch, b"Weg [mm];Kraft [N]", b"0,1;19,8", b"0,2;1.234")
    first, second = map(json.loads, here("track", "--gear", GEAR).stdout.splitlines())
    assert first["status"] == "ok" and "decimal point among" in second["error"]


def test_nothing_in_nothing_out(here: Hdcal, monkeypatch):
    feed(monkeypatch)
    done = here("track", "--gear", GEAR)
    assert (done.returncode, done.stdout) == (0, "")


def test_it_begins_where_the_calibration_ended(here: Hdcal, calibrated, monkeypatch):
    feed(monkeypatch, GOOD, b'{"deformation_mm": 0.9, "force_N": 180}')
    done = here("track", calibrated[1])
    assert done.returncode == 0
    first, last = (json.loads(line) for line in done.stdout.splitlines())
    summary = json.loads(calibrated[0].stdout)["stiffness_N_per_mm"]
    low, high = first["stiffness_N_per_mm"]["credible_95"]
    assert summary["lo"] - 2.0 < low < summary["median"] < high < summary["hi"] + 2.0
    assert (first["tested"], last["tested"]) == (True, False)


def test_bad_arguments_are_refused(here: Hdcal, tmp_path: Path):
    for given in ([], [tmp_path, "--gear", GEAR]):
        done = here("track", *given)
        assert done.returncode == 2 and "not both" in done.stderr
    done = here("track", "--gear", GEAR, "--forget", "3", "--alarm-rows", "1", "--json")
    assert done.returncode == 2
    found = [one["file"] for one in json.loads(done.stdout)["findings"]]
    assert found == ["--alarm-rows", "--forget"]
    assert here("track", tmp_path).returncode == 2
    assert here("track", "--gear", tmp_path / "no.toml").returncode == 2


def test_an_answer_comes_before_the_next_line_and_ctrl_c_ends():
    with subprocess.Popen(
        [*MAIN, "track", "--gear", str(GEAR)],
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
