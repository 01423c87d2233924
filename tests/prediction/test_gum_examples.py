"""The division of the variance on the examples of the GUM and of JCGM 101.

The inputs are drawn (JCGM 101:2008); the printed numbers are those of the standards.
"""

import numpy as np
import pytest

from hdcal.prediction.margin.budget import divided

TRIALS = 1_000_000  # as JCGM 101


class Inputs:
    """Draws of the inputs of an example."""

    def __init__(self, seed: int = 0) -> None:
        self.rng = np.random.default_rng(seed)

    def normal(self, mean: float, sd: float) -> np.ndarray:
        return self.rng.normal(mean, sd, TRIALS)

    def within(self, low: float, high: float) -> np.ndarray:
        return self.rng.uniform(low, high, TRIALS)


def shortest(values: np.ndarray, coverage: float) -> tuple[float, float]:
    """Return the shortest coverage interval (JCGM 101, 5.3.4)."""
    values, inside = np.sort(values), round(coverage * len(values))
    start = int(np.argmin(values[inside:] - values[:-inside]))
    return float(values[start]), float(values[start + inside])


def shares_of(output: np.ndarray, inputs: dict) -> dict[str, float]:
    """Return the parts of the variance, which sum to it."""
    parts = {name: row[2] for name, row in divided(output, inputs, "rest").items()}
    assert sum(parts.values()) == pytest.approx(np.var(output), rel=1e-9)
    return parts


def test_the_end_gauge_of_h1():
    """JCGM 100:2008, Table H.1; linear terms: 25, 9.7, 0, 0, 2.9 and 16.6 nm."""
    draw = Inputs()
    inputs = {
        "l_S": draw.normal(623.0, 25.0),
        "d": draw.normal(215.0, 9.7),
        "alpha": draw.within(9.5e-6, 13.5e-6),
        "theta": draw.normal(-0.1, 0.41),
        "excess": draw.within(-1e-6, 1e-6),
        "warmer": draw.within(-0.05, 0.05),
    }
    l_s, d, alpha, theta, excess, warmer = inputs.values()
    # JCGM 100:2008, (H.3); deviation from the nominal 50 mm [nm].
    output = l_s + d - (50e6 + l_s) * (excess * theta + alpha * warmer)
    assert round(output.mean()) == 838
    parts = shares_of(output, inputs)
    for name, printed in {"l_S": 25.0, "d": 9.7, "excess": 2.9, "warmer": 16.6}.items():
        assert parts[name] ** 0.5 == pytest.approx(printed, abs=0.1)
    # What no line by an input explains: expansion times warmth, and theta (H.1.7).
    linear = sum(parts.values()) - parts["rest"]
    assert round(linear**0.5) == 32 and round(np.sqrt(sum(parts.values()))) == 34
    assert parts["rest"] ** 0.5 == pytest.approx(np.hypot(11.7, 1.7), abs=0.3)


ROOT3 = 3.0**0.5


def test_the_additive_model_of_9_2():
    """JCGM 101:2008, Table 4: rectangular inputs, of which one is ten times larger."""
    draw, sds = Inputs(), (1.0, 1.0, 1.0, 10.0)
    inputs = {f"x{i}": draw.within(-ROOT3 * sd, ROOT3 * sd) for i, sd in enumerate(sds)}
    output = sum(inputs.values())
    assert output.std() == pytest.approx(10.1, abs=0.06)
    assert np.abs(np.quantile(output, [0.025, 0.975])) == pytest.approx(17.0, abs=0.06)
    parts = shares_of(output, inputs)
    for each, sd in zip(inputs, sds, strict=True):
        assert abs(parts[each] - sd**2) < 5e-3 * sd**2 + 0.06
    assert parts["rest"] < 1e-6


def test_the_mass_calibration_of_9_3():
    """JCGM 101:2008, Table 6: 1.2341, 0.0754 and [1.0834, 1.3825] mg."""
    draw = Inputs()
    inputs = {
        "reference": draw.normal(100_000.0, 0.050),
        "added": draw.normal(1.234, 0.020),
        "air": draw.within(1.10, 1.30),
        "weight": draw.within(7_000.0, 9_000.0),
        "standard": draw.within(7_950.0, 8_050.0),
    }
    reference, added, air, weight, standard = inputs.values()
    buoyancy = (air - 1.2) * (1.0 / weight - 1.0 / standard)
    output = (reference + added) * (1.0 + buoyancy) - 100_000.0
    assert output.mean() == pytest.approx(1.2341, abs=3e-4)
    assert output.std() == pytest.approx(0.0754, abs=2e-4)
    assert shortest(output, 0.95) == pytest.approx((1.0834, 1.3825), abs=3e-3)
    parts = shares_of(output, inputs)
    # The linear terms give 0.0539 mg; the product of the densities is the rest.
    linear = parts["reference"] + parts["added"]
    assert linear**0.5 == pytest.approx(0.0539, abs=2e-4)
    assert parts["rest"] ** 0.5 == pytest.approx(0.0528, abs=5e-4)


def test_an_input_in_order_takes_what_those_before_it_left():
    rng = np.random.default_rng(4)
    first, other = rng.normal(size=(2, 100_000))
    second = 0.8 * first + 0.6 * other
    found = divided(first + second, {"a": first, "b": second, "c": first}, "rest")
    assert [*found] == ["a", "b", "rest"]
    assert found["a"][2] == pytest.approx(1.8**2, rel=0.02)
    assert found["b"][2] == pytest.approx(0.6**2, rel=0.02)
    assert found["rest"][2] < 1e-9
    # Chance in few draws is no correlation.
    few = divided(first[:50], {"noise": other[:50]}, "rest")
    assert [*few] == ["rest"]
