"""What a question about readings advises leads to the right stiffness."""

import numpy as np
import pytest

from hdcal.data.reading import read_case
from hdcal.errors import InputError

TRUTH = 20.0
X = np.linspace(0.0, 10.0, 200)


def table(headers: list[str], *columns: np.ndarray) -> str:
    """Return the text of a CSV file."""
    rows = [",".join(f"{cell:.5g}" for cell in row) for row in np.transpose(columns)]
    return "\n".join([",".join(headers), *rows])


def force(x: np.ndarray, seed: int = 1) -> np.ndarray:
    return TRUTH * x + np.random.default_rng(seed).normal(0.0, 0.2, x.size)


def swaying(x: np.ndarray) -> np.ndarray:
    """Return a force that falls at first, and rises by 20 N/mm from 2 to 4 mm."""
    return force(x) + 28.0 * (np.abs(x % 4.0 - 2.0) - x)


TWICE = np.r_[X, X]
CLOCK = {"displacement_mm": TWICE, "force_N": force(TWICE), "time_s": np.r_[X, X]}
GAUGES = table(["Force [N]", "LVDT 1 [mm]", "LVDT 2 [mm]"], force(X), X, 1.7 * X)
NO_UNITS = table(["displacement", "load"], X, force(X))
SWAYING = {"displacement_mm": X, "force_N": swaying(X)}
QUESTIONS = {
    "a new test": (CLOCK, {}, "a column 'run'", {"run": [1] * 200 + [2] * 200}),
    "two gauges": (GAUGES, {}, "by its number", {"columns": {"deformation": "2"}}),
    "no units": (
        NO_UNITS,
        {},
        "'force=load[UNIT]'",
        {"columns": {"deformation": "displacement[mm]", "force": "load[N]"}},
    ),
    "a falling force": (SWAYING, {}, "by `range`", {"range": "2.05:3.95"}),
}


def slope(case) -> float:
    """Return the slope of parallel lines through the runs [N/mm]."""
    records = case.records
    columns = [records.deformation, *(records.run == label for label in {*records.run})]
    return float(np.linalg.lstsq(np.stack(columns, 1), records.force, rcond=None)[0][0])


@pytest.mark.parametrize("name", QUESTIONS)
def test_what_a_question_advises_gives_the_stiffness(name, tmp_path):
    data, asked, words, advised = QUESTIONS[name]
    if isinstance(data, str):
        file = tmp_path / "readings.csv"
        file.write_text(data, "utf-8")
        data = file
    with pytest.raises(InputError) as question:
        read_case(data, **asked)
    assert words in str(question.value)
    if "run" in advised:
        data, advised = data | advised, {}
    assert slope(read_case(data, **advised)) == pytest.approx(TRUTH, rel=4e-3)
