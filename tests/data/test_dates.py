"""Dates are read as rigs write them, and never guessed."""

import numpy as np
import pytest

from hdcal.data.measurements.dates import dates_of


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("2026-09-03", "2026-09-03T00:00:00"),
        ("2026-09-03T10:20:30", "2026-09-03T10:20:30"),
        ("2026-09-03T00:30+02:00", "2026-09-03T00:30:00"),
        ("2026-09-03T23:30:00Z", "2026-09-03T23:30:00"),
        ("2026/09/03", "2026-09-03T00:00:00"),
        ("03.09.2026", "2026-09-03T00:00:00"),
        ("03.09.2026 10:20", "2026-09-03T10:20:00"),
        ("13/09/2026", "2026-09-13T00:00:00"),
        ("09/13/2026", "2026-09-13T00:00:00"),
    ],
)
def test_a_date_is_read(written, read):
    assert dates_of([written], np.array([0])) == ((read,), "")


@pytest.mark.parametrize(
    ("written", "why"),
    [
        ("03/04/2026", "can be read in two ways"),
        ("45123", "cannot be read as one"),
        ("yesterday", "cannot be read as one"),
        ("0203-09-01", "cannot be read as one"),
    ],
)
def test_what_is_no_date_is_told(written, why):
    dates, note = dates_of([written], np.array([0]))
    assert dates == ()
    assert written in note and why in note


def test_other_dates_settle_what_slashes_mean():
    dates, _ = dates_of(["03/04/2026", "13/04/2026"], np.arange(2))
    assert dates[0] == "2026-04-03T00:00:00"


def test_one_wrong_date_costs_no_other():
    labels = ["01.09.2026", "02.09.2026", "03/09/2026", "04.09.2026"]
    dates, note = dates_of(labels, np.arange(4))
    assert [date[:10] for date in dates] == [
        "2026-09-01",
        "2026-09-02",
        "",
        "2026-09-04",
    ]
    assert "'03/09/2026'" in note
