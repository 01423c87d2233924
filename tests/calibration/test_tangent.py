"""The stiffness at the end of the tested range equals closed forms."""

import numpy as np
import pytest
from posteriors import beside, regressed, single

from hdcal.calibration.tangent import tangent_stiffness

X = np.linspace(0.02, 0.5, 25)


@pytest.mark.parametrize(
    ("effect", "values", "factor"),
    [
        ("contact_onset", {"ratio": 3.0, "onset": 0.2}, 4.0),
        ("progressive_stiffening", {"slope": 0.4}, 1.0 + 2.0 * 0.4 * 0.495),
        ("seating_slack", {"clearance": 0.05}, 1.0),
    ],
)
def test_the_stiffness_at_the_end_has_the_effect_in_it(effect, values, factor):
    rng = np.random.default_rng(1)
    others = {f"{effect}__{name}": value for name, value in values.items()}
    force = 100.0 * X + rng.normal(0.0, 0.2, len(X))
    posterior = regressed(X, force, rng, effects=(effect,), **others)
    found = tangent_stiffness(posterior)
    assert found is not None
    at, stiffness = found
    straight = np.quantile(posterior.draws["stiffness"], [0.025, 0.5, 0.975])
    assert at == 0.5
    ends = stiffness.lo, stiffness.median, stiffness.hi
    assert ends == pytest.approx(factor * straight, rel=2e-3)


def test_none_without_an_effect_that_changes_the_stiffness():
    assert tangent_stiffness(single(size=20)) is None
    assert tangent_stiffness(beside(single(size=20), "thermal_zero_drift")) is None
