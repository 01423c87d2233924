"""An answer does not depend on units, scale, sign or number format of the readings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import rich, simulated
from rigs import make_case

from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.diagnosis.diagnose import diagnose
from hdcal.diagnosis.result import Diagnosis
from hdcal.physics.registry import EFFECTS

FRICTION = {"coulomb_friction": {"force": 1.0}}
# It distinguishes pressing from pulling, and depends on the radius.
LIBRARY = {n: e for n, e in EFFECTS.items() if n != "large_deflection"}
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
    units: tuple[str, str, str] = ("mm", "N", "s"),
    sizes: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> Case:
    """Return the case as read from a file, the length of the gear scaled to match.

    Force and deformation are multiplied by factors; `sizes` are those of the units of
    deformation, force and time in mm, N and s.
    """
    r = case.records
    columns = {
        f"deformation_{units[0]}": deformation * np.asarray(r.deformation) / sizes[0],
        f"force_{units[1]}": force * np.asarray(r.force) / sizes[1],
        "temperature_C": np.asarray(r.temperature),
        f"time_{units[2]}": np.asarray(r.time) / sizes[2],
        "remark": np.arange(len(r.force)) * 0.1,
    }
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
    "six digits": {"number": "%.6g"},
    "kN, µm and minutes": {"units": ("um", "kN", "min"), "sizes": (1e-3, 1e3, 60.0)},
}


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """Return readings with friction; the motion is derived on reading."""
    program = written(simulated(rich()), tmp_path_factory.mktemp("case") / "read")
    return simulated(program.records, FRICTION, seed=7)


@pytest.fixture(scope="module")
def first(case: Case, tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    read = written(case, tmp_path_factory.mktemp("first") / "read")
    return diagnose(read, library=LIBRARY, quick=True)


@pytest.mark.parametrize("change", CHANGES)
def test_the_answer_stays(first: Diagnosis, case: Case, change: str, tmp_path: Path):
    settings = CHANGES[change]
    read = written(case, tmp_path / "second", **settings)
    second = diagnose(read, library=LIBRARY, quick=True)
    assert "coulomb_friction" in second.which.acting[0].members
    assert second.which.verdict == first.which.verdict
    assert {*second.which.causes[0].members} == {*first.which.causes[0].members}
    for name, chance in first.which.inclusion.items():
        # The zero of the deformation has the same prior whatever the stroke.
        assert second.which.inclusion[name] == pytest.approx(chance, abs=0.05)
    scale = abs(settings.get("force", 1.0))
    sd = second.gap.noise_sd_N
    assert sd == pytest.approx(scale * first.gap.noise_sd_N, rel=0.02)


def test_pulled_readings_have_the_same_answer():
    effect = {"hysteresis": {"force": 4.0, "reach": 0.1}}
    records = simulated(rich(), effect, seed=1).records
    names = ("deformation", "force", "direction", "sense", "rate")
    turned = {name: -np.asarray(getattr(records, name)) for name in names}
    pressed, pulled = (
        diagnose(make_case(each), library=LIBRARY, quick=True)
        for each in (records, replace(records, **turned))
    )
    # A draw or two of two hundred may change sides of a threshold.
    assert pulled.which.inclusion == pytest.approx(pressed.which.inclusion, abs=0.01)
    assert pressed.how_far.closed is not None and pulled.how_far.closed is not None
    median = pressed.how_far.closed.median
    assert pulled.how_far.closed.median == pytest.approx(median, abs=1e-6)
    assert [s.statement for s in pulled.seen] == [s.statement for s in pressed.seen]
    assert [r.run for r in pulled.next_test] == [r.run for r in pressed.next_test]


def test_the_seed_decides_all_random_numbers():
    case = simulated(rich(), FRICTION, seed=7)
    library = {name: EFFECTS[name] for name in ("coulomb_friction", "hysteresis")}
    one, same, other = (
        diagnose(case, library=library, quick=True, seed=s) for s in (1, 1, 2)
    )
    assert one.to_json() == same.to_json()
    np.testing.assert_array_equal(one.rows.draws, same.rows.draws)
    assert not np.array_equal(one.rows.draws, other.rows.draws)
