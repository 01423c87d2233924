"""Several specimens are seen before anything is inferred of them."""

import numpy as np
import pytest

from hdcal.calibration.check.summary import check_answer
from hdcal.data.reading import read_case

X = np.linspace(0.0, 0.5, 6)
SLOPES = {"A": 100.0, "B": 120.0, "C": 90.0}


def case_of(*names: str):
    """Return two runs of each, of which the second has another zero."""
    rows = [
        (n, f"{n}{r}", x, SLOPES[n] * x + 3.0 * r)
        for n in names
        for r in (0, 1)
        for x in X
    ]
    columns = dict(
        zip(
            ("specimen", "run", "deformation_mm", "force_N"),
            zip(*rows, strict=True),
            strict=True,
        )
    )
    return read_case({name: np.array(values) for name, values in columns.items()})


def test_each_specimen_has_its_rows_runs_and_slope():
    answer = check_answer(case_of("A", "B", "C"))
    assert {s.name: s.stiffness_N_per_mm for s in answer.specimens} == pytest.approx(
        SLOPES
    )
    assert {(s.rows, s.runs) for s in answer.specimens} == {(12, 2)}
    assert "`fleet`" in (answer.next_step or "")


def test_two_are_shown_but_no_fleet():
    answer = check_answer(case_of("A", "B"))
    assert len(answer.specimens) == 2 and answer.next_step is None


def test_one_is_no_table():
    assert check_answer(case_of("A")).specimens == ()
