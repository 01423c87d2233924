"""The blind check from sealing to scores, interrupted in between."""

import json
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.blind import __main__ as program
from benchmarks.blind.answers import answer_set
from benchmarks.blind.diagnosers import by_bic, by_hdcal, by_none, by_r2
from benchmarks.blind.rivals import closable, fit_each
from commands import XB1
from diagnosis_cases import NOISE, rich, simulated
from rigs import make_case
from stub_diagnosers import noted

import hdcal
from hdcal.errors import InputError
from hdcal.physics.registry import EFFECTS


@pytest.mark.thorough
def test_a_run_of_four_cases_with_an_interruption(tmp_path, monkeypatch, capsys):
    folder, noted_cases = tmp_path / "set", tmp_path / "noted"
    monkeypatch.setenv("NOTED_CASES", str(noted_cases))
    monkeypatch.setenv("FAILING_CASE", "case-3")
    make = ["make", "--cases", "4", "--mix", "withheld", "--out", str(folder)]
    assert program.main(make) == 0
    commitment = capsys.readouterr().out.split()[1]
    with pytest.raises(RuntimeError, match=r"case-3\.csv: ValueError: planted"):
        answer_set(folder, "stub", noted)
    opening = ["open", str(folder), "--key", f"{folder}.key"]
    assert program.main(opening) == 2
    assert "not complete" in capsys.readouterr().err
    noted_cases.unlink()
    # Half a line, as of a run that was killed.
    kept = folder / "answers-stub.jsonl"
    kept.write_text(kept.read_text() + '{"case": "case')
    monkeypatch.delenv("FAILING_CASE")
    frozen, sha256 = answer_set(folder, "stub", noted)
    asked = [line.split() for line in noted_cases.read_text().splitlines()]
    # Nothing is answered twice, and two effects are withheld.
    assert asked == [["case-3", str(len(hdcal.EFFECTS) - 2)]]
    assert frozen.blind and [a.case for a in frozen.answers] == [
        f"case-{number}" for number in range(1, 5)
    ]
    with pytest.raises(InputError, match="these answers are frozen"):
        answer_set(folder, "stub", noted)
    assert program.main(opening) == 0
    printed = capsys.readouterr().out
    assert f"commitment {commitment}" in printed and f"answers {sha256}" in printed
    scores = json.loads((folder / "result" / "scores.json").read_text())
    found = {row["what"]: row["found"] for row in scores["rows"]["stub"]}
    withheld = [name for name in found if name.startswith("true effect with")]
    assert [found[name]["n"] for name in withheld] == [4]
    assert (folder / "result" / "reliability.png").stat().st_size > 1000


@pytest.mark.thorough
def test_a_sealed_measurement_is_answered_and_opened(tmp_path, capsys):
    folder, data = tmp_path / "mine", ["--from", str(XB1 / "data.csv")]
    make = ["make", *data, "--out", str(folder), "--withhold", "large_deflection"]
    for cause in ("", "large_deflection", "gremlins"):
        assert program.main([*make, "--cause", cause]) == 2
    assert not folder.exists()
    assert program.main([*make, "--cause", "contact_onset, plastic_yield"]) == 0
    assert [path.name for path in (folder / "cases").iterdir()] == ["case.csv"]
    assert program.main(["answer", str(folder), "--by", "none"]) == 0
    assert program.main(["open", str(folder), "--key", f"{folder}.key"]) == 0
    assert "stated contact_onset or plastic_yield" in capsys.readouterr().out


SHOWN = {
    "thermal_zero_drift": lambda r: 0.08 * (r.temperature - 20.0),
    "coulomb_friction": lambda r: 1.5 * r.sense,
}


def clean(name: str):
    """Return a straight line with one effect, without noise."""
    records = simulated(rich()).records
    soft = 1.0 - 3e-4 * (records.temperature - 20.0)
    force = 195.0 * records.deformation * soft + SHOWN[name](records)
    return make_case(replace(records, force=force))


@pytest.mark.parametrize("name", SHOWN)
def test_least_squares_finds_the_true_effect(name: str):
    found = fit_each(clean(name), EFFECTS, NOISE)
    assert found[name].square < 0.01 * found["none"].square
    assert found[name].bic < found["none"].bic
    shares = closable(clean(name), EFFECTS, NOISE)
    assert shares[name] > 0.95
    assert shares["screw_error"] < 0.3


def test_rivals_on_noise_alone():
    case = simulated(rich(), seed=6)
    found = fit_each(case, EFFECTS)
    # In sample every effect fits at least as well as none.
    assert all(f.square <= found["none"].square + 1e-9 for f in found.values())
    bic, r2, none = (by(case, EFFECTS) for by in (by_bic, by_r2, by_none))
    assert bic.set[0] == none.set[0] == "none" and r2.classes[0].acts == 1.0
    for each in (bic, r2, none):
        assert np.isclose(sum(each.explanations.values()), 1.0)
        assert sum(each.explanations[name] for name in each.set) >= 0.9


@pytest.mark.thorough
def test_hdcal_answers_as_it_decides():
    size = {"hysteresis": {"force": 4.0, "reach": 0.1}}
    plain, loop = (by_hdcal(simulated(rich(), e, seed=1), EFFECTS) for e in ({}, size))
    assert not plain.detected and plain.set[0] == "none"
    assert loop.inclusion["hysteresis"] > 0.9 and loop.set == ("hysteresis",)
    first = loop.classes[0]
    assert first.members[0] == "hysteresis" and first.acts > 0.9
    assert first.explains is not None and loop.gap_N is not None
    for each in (plain, loop):
        assert np.isclose(sum(each.explanations.values()), 1.0)
