"""A check shows each of several specimens."""

import re

import numpy as np
import pytest

from hdcal.calibration.check.check import check
from hdcal.data.reading import read_case

X = np.linspace(0.0, 0.5, 6)
SLOPES = {"A": 100.0, "B": 120.0, "C": 90.0}


def case_of(*names: str, held: str = ""):
    """Return two runs of each, of which the second has another zero; one is held."""
    rows = [
        (n, f"{n}{r}", 0.3 if n == held else x, SLOPES[n] * x + 3.0 * r)
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
    found = check(case_of("A", "B", "C"))
    assert {s.name: s.stiffness_N_per_mm for s in found.specimens} == pytest.approx(
        SLOPES
    )
    assert {(s.rows, s.runs) for s in found.specimens} == {(12, 2)}
    assert "`fleet`" in (found.next_step or "")


def test_a_specimen_that_is_held_has_no_slope_and_the_others_keep_their_digits():
    found = check(case_of("A", "B", held="B"))
    one, other = (s.stiffness_N_per_mm for s in found.specimens)
    assert one == pytest.approx(100.0) and np.isnan(other)
    assert re.findall(r"^[AB] .* (\S+)$", found.text(), re.MULTILINE) == ["100", "–"]


def test_two_are_shown_but_no_fleet():
    found = check(case_of("A", "B"))
    assert len(found.specimens) == 2 and found.next_step is None


def test_one_is_no_table():
    assert check(case_of("A")).specimens == ()
