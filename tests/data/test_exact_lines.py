"""Readings that lie on a line to the last digit: nothing tells their noise."""

import numpy as np
import pandas as pd
import pytest

from hdcal import InputError, calibrate, diagnose, read_case

_LINE = np.arange(1, 11) / 10.0


def _case(force, x=_LINE, step=None, **labels):
    table = pd.DataFrame({"deformation_mm": x, "force_N": force, **labels})
    stated = {"measurement": {"force_resolution_N": step}} if step else {}
    return read_case(table, gear={"gear": {"name": "s", "theory": "spring"}, **stated})


@pytest.mark.parametrize("ask", [calibrate, diagnose])
@pytest.mark.parametrize("line", [lambda x: 100 * x + 2, lambda x: 100 / 3 * x - 7.1])
def test_an_exact_line_is_refused(ask, line):
    with pytest.raises(InputError, match="exactly on a straight line"):
        ask(_case(line(_LINE)))


@pytest.mark.thorough
def test_a_display_that_shows_a_line_is_answered_by_its_step():
    case = _case(np.round(100 * _LINE + 2), step=1.0)
    found = calibrate(case, draws=400)
    assert not found.reasons
    low, high = np.quantile(found.draws["K"], [0.025, 0.975])
    # 0.29 N over these strokes: sd 0.32 N/mm were it the only one.
    assert low < 100 < high
    assert 0.5 < high - low < 4
    assert diagnose(case, quick=True).which.effect is None


def test_readings_of_which_none_is_left_over_are_refused_in_other_words():
    force = [0.0, 21.0, 43.0, 60.0, 82.0, 99.0]
    x = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    with pytest.raises(InputError, match="scatter of the readings cannot be estimated"):
        calibrate(_case(force, x, run=np.arange(6)))
