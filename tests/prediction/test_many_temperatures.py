"""A hundred thousand temperatures are answered, as each of them alone would be."""

import numpy as np
import pytest
from posteriors import batch, single

import hdcal
from hdcal.errors import InputError
from hdcal.prediction.margin.temperatures import nodes_of

QUICK = {"limit_force": 95.0, "sensitivities": False}


@pytest.mark.thorough
@pytest.mark.parametrize("make", [single, batch])
def test_each_is_what_it_is_alone(make):
    posterior, warm = make(size=500), np.linspace(-40.0, 120.0, 100_000)
    found = hdcal.margin(posterior, 0.4, temperature=warm, **QUICK)
    assert len(found.levels) == len(warm)
    rows = [0, 3, 37_499, 37_500, 37_512, 60_001, 88_888, 99_999]
    alone = hdcal.margin(posterior, 0.4, temperature=warm[rows], **QUICK).levels
    for row, level in zip(rows, alone, strict=True):
        other = found.levels[row]
        assert other.temperature_C == level.temperature_C
        assert other.tested == level.tested
        width = level.upper_bound_N - level.lower_bound_N
        for name in ("lower_bound_N", "upper_bound_N", "capacity_predictive_N"):
            error = getattr(other, name) - getattr(level, name)
            assert abs(error) < 3e-3 * width, name
        assert other.member_N.hi == pytest.approx(level.member_N.hi, abs=3e-3 * width)
        assert other.exceedance.beta == pytest.approx(level.exceedance.beta, rel=2e-3)
    worst = hdcal.margin(posterior, 0.4, temperature=warm[[0, -1]], **QUICK).worst
    assert found.worst.upper_bound_N == pytest.approx(worst.upper_bound_N, rel=1e-3)


def test_nodes_hold_both_ends_and_where_the_rig_begins_to_drift():
    records = single(size=10).case.records
    for warm in (np.linspace(-40.0, 120.0, 5001), np.linspace(120.0, 300.0, 2000)):
        nodes = nodes_of(warm, records)
        assert len(nodes) < 310 and {*nodes} <= {*warm}
        assert nodes[0] == warm.min() and nodes[-1] == warm.max()
    assert 20.0 in nodes_of(np.linspace(-40.0, 120.0, 5001), records).round(9)
    few = np.linspace(0.0, 80.0, 1000)
    assert nodes_of(few, records) is few


def test_more_are_refused():
    with pytest.raises(InputError, match="100001 temperatures are too many"):
        hdcal.margin(single(size=20), 0.4, temperature=np.linspace(0, 80, 100_001))
