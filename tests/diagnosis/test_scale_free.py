"""A verdict does not hang on units, scale, sign or number format of the readings."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import judged, rich, simulated
from slices import slice_of

from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.data.records import Records
from hdcal.evidence.row_features import take_rows
from hdcal.physics.registry import EFFECTS as REGISTRY

EFFECTS = {
    "coulomb_friction": {"force": 1.0},
    "progressive_stiffening": {"slope": 0.06},
    "thermal_zero_drift": {"slope": 0.03},
    "relaxation": {"share": 0.05, "time_constant": 40.0},
}
# It knows pressing from pulling, and has a radius.
OWN_SCALE = ("large_deflection",)
LIBRARY = {n: e for n, e in REGISTRY.items() if n not in OWN_SCALE}
GEAR = """\
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = {length!r}
material = "40CrNiMoA"
"""


def written(
    case: Case,
    folder: Path,
    *,
    force: float = 1.0,
    deformation: float = 1.0,
    number: str = "%r",
    minutes: bool = False,
    extra: bool = False,
) -> Case:
    """Return the case after a file in other units, the gear's length to match."""
    r, clock = case.records, 60.0 if minutes else 1.0
    columns = {
        "deformation_mm": deformation * np.asarray(r.deformation),
        "force_N": force * np.asarray(r.force),
        "temperature_C": np.asarray(r.temperature),
        "time_min" if minutes else "time_s": np.asarray(r.time) / clock,
    }
    if extra:
        columns["remark"] = np.arange(len(r.force)) * 0.1
    table = np.column_stack(list(columns.values())).tolist()
    lines = [",".join(columns)]
    lines += [",".join(number % value for value in row) for row in table]
    folder.mkdir()
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    length = 70.0 * abs(force / deformation)
    (folder / "gear.toml").write_text(GEAR.format(length=length))
    return read_case(folder)


CHANGES = {
    "stiffer and smaller": {"force": 37.0, "deformation": 0.21},
    "softer and larger": {"force": 0.05, "deformation": 30.0},
    "pulled": {"force": -1.0, "deformation": -1.0},
    "six digits": {"number": "%.6g"},
    "minutes": {"minutes": True},
    "a column that says nothing": {"extra": True},
}


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Records:
    """The program as a file tells it: whether a row was moved to is derived."""
    return written(simulated(rich()), tmp_path_factory.mktemp("as") / "read").records


def which_of(case: Case):
    return judged(case, library=LIBRARY).which


@pytest.fixture(scope="module")
def first(program, tmp_path_factory):
    """Return the verdict on readings of an effect as they are; each is judged once."""
    folder = tmp_path_factory.mktemp("first")

    @cache
    def judged_once(name: str):
        case = simulated(program, {name: EFFECTS[name]}, seed=7)
        return which_of(written(case, folder / name))

    return judged_once


@pytest.mark.parametrize("change", slice_of(CHANGES, [*CHANGES][:3]))
@pytest.mark.parametrize("name", slice_of(EFFECTS, ["coulomb_friction"]))
def test_the_verdict_stays(first, program, name, change, tmp_path):
    as_it_is = first(name)
    case = simulated(program, {name: EFFECTS[name]}, seed=7)
    second = which_of(written(case, tmp_path / "second", **CHANGES[change]))
    assert (second.effect, second.group) == (as_it_is.effect, as_it_is.group)
    # The prior of the contact is in millimetres, whatever the stroke: probabilities
    # change a little with it, and words at their thresholds.
    if "deformation" not in CHANGES[change] or change == "pulled":
        assert second.verdict == as_it_is.verdict
    for hypothesis, chance in as_it_is.probabilities.items():
        # The zero of the deformation is found by hand whatever the stroke.
        found = second.probabilities.get(hypothesis, 0.0)
        assert found == pytest.approx(chance, abs=0.05)


@pytest.mark.parametrize("name", slice_of(EFFECTS, ["coulomb_friction"]))
def test_the_verdict_is_that_of_the_truth(first, name):
    alike = {"thermal_zero_drift": {"thermal_expansion", "thermal_zero_drift"}}
    assert first(name).effect in alike.get(name, {name})


def oversampled(program: Records, times: int) -> Records:
    """Return the program with this many rows for each, the stroke in finer steps."""
    place = np.arange(len(program.force) * times) / times
    whole = np.minimum(place.astype(int), len(program.force) - 1)
    rows = take_rows(program, whole)
    w, t = (
        np.interp(place, np.arange(len(program.force)), np.asarray(column))
        for column in (program.deformation, program.time)
    )
    return replace(rows, deformation=w, time=t)


@pytest.mark.thorough
def test_a_log_read_faster_than_the_rig_moves_keeps_its_group(program):
    """Rows that err alike are no new evidence, and no noise that hides a loop."""
    effect = {"hysteresis": {"force": 2.5, "reach": 0.15}}
    plain = judged(simulated(program, effect, seed=9))
    log = simulated(oversampled(program, 8), effect, seed=9, correlation=0.95)
    found = judged(log)
    assert found.row_step > 1
    assert found.which.verdict in ("named", "group")
    assert found.which.group == plain.which.group == "loop"


@pytest.mark.thorough
def test_a_log_without_a_gap_has_none(program):
    """Of 6 logs; two alarms or more would come once in 30 at 5 %."""
    alarms = [
        judged(
            simulated(oversampled(program, 8), seed=seed, correlation=0.95)
        ).which.verdict
        != "none"
        for seed in range(6)
    ]
    assert sum(alarms) < 2
