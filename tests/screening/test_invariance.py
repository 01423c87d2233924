"""Findings do not change with origin, scale, unit or the sign of both channels."""

import numpy as np
import pytest
from benchmarks.springs.record import ALL, faulty_spring

from hdcal.screening.screen import screen

# Powers of two keep every digit.
CHANGES = {
    "origin": lambda x, y: (x + 64.0 * np.ptp(x), y),
    "offset": lambda x, y: (x, y - 8.0 * np.ptp(y)),
    "scale": lambda x, y: (2.0**9 * x, 2.0**-12 * y),
    "units": lambda x, y: (x / 25.4, y / 4.4482216),
    "both signs": lambda x, y: (-x, -y),
}


@pytest.mark.parametrize("fault", ALL)
def test_findings_do_not_change(fault):
    for seed in range(2):
        spring = faulty_spring(np.random.default_rng([seed, 5]), [fault])
        first = screen(spring.deformation, spring.force)
        for change in CHANGES.values():
            other = screen(*change(spring.deformation, spring.force))
            findings = [
                [(one.kind, one.rows, one.action) for one in each.observations]
                for each in (first, other)
            ]
            assert findings[0] == findings[1]
            np.testing.assert_array_equal(first.kept, other.kept)
            np.testing.assert_array_equal(first.zero, other.zero)


@pytest.mark.parametrize("channel", ["deformation", "force"])
def test_one_sign_alone_is_turned(channel):
    spring = faulty_spring(np.random.default_rng(3), [])
    x, y = spring.deformation, spring.force
    found = screen(-x, y) if channel == "deformation" else screen(x, -y)
    assert [one.kind for one in found.observations] == ["opposite sign"]
    assert found.straight is not None
    assert found.straight.slope == pytest.approx(spring.stiffness, rel=0.02)
