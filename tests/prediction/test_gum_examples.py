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


READ = np.array(
    [
        [5.007, 4.994, 5.005, 4.990, 4.999],
        [19.663e-3, 19.639e-3, 19.640e-3, 19.685e-3, 19.678e-3],
        [1.0456, 1.0438, 1.0468, 1.0428, 1.0433],
    ]
)
# JCGM 100:2008, Tables H.3 and H.4: value, uncertainty and correlation.
PRINTED = {"R": (127.732, 0.071), "X": (219.847, 0.296), "Z": (254.260, 0.236)}
TIED = {"RX": -0.588, "RZ": -0.485, "XZ": 0.993}


def test_resistance_and_reactance_of_h2():
    mean, covariance = READ.mean(axis=1), np.cov(READ) / 5
    drawn = np.random.default_rng(1).multivariate_normal(mean, covariance, TRIALS)
    voltage, current, phase = drawn.T
    ratio = voltage / current
    found = {"R": ratio * np.cos(phase), "X": ratio * np.sin(phase), "Z": ratio}
    inputs = {"V": voltage, "I": current, "phi": phase}
    for name, (value, uncertainty) in PRINTED.items():
        assert found[name].mean() == pytest.approx(value, abs=1e-3)
        parts = shares_of(found[name], inputs)
        assert np.sqrt(sum(parts.values())) == pytest.approx(uncertainty, abs=1e-3)
        # A plane through the three inputs leaves nothing: all of it is theirs.
        assert parts["rest"] < 1e-3 * sum(parts.values())
    for pair, printed in TIED.items():
        tied = np.corrcoef(*(found[name] for name in pair))[0, 1]
        assert tied == pytest.approx(printed, abs=3e-3)


ROOT3 = 3.0**0.5
# JCGM 101:2008, Tables 2, 3 and 4: sds of the rectangular inputs, half the interval.
ADDED = {"9.2.3": ((1.0,) * 4, 2.0, 3.88), "9.2.4": ((1.0,) * 3 + (10.0,), 10.1, 17.0)}


@pytest.mark.parametrize("name", ADDED)
def test_the_additive_model_of_9_2(name: str):
    sds, printed, half = ADDED[name]
    draw = Inputs()
    inputs = {f"x{i}": draw.within(-ROOT3 * sd, ROOT3 * sd) for i, sd in enumerate(sds)}
    output = sum(inputs.values())
    assert output.std() == pytest.approx(printed, abs=0.06 if printed > 9 else 0.005)
    ends = np.abs(np.quantile(output, [0.025, 0.975]))
    assert ends == pytest.approx(half, abs=0.06 if half > 9 else 0.02)
    parts = shares_of(output, inputs)
    for each, sd in zip(inputs, sds, strict=True):
        assert abs(parts[each] - sd**2) < 5e-3 * sd**2 + (0.06 if half > 9 else 0.02)
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


# JCGM 101:2008, Tables 8 and 9 in 1e-6: correlation, x₁; mean, u, shortest interval.
MISMATCH = [
    (0.0, 0.000, 50, 50, (0, 150)),
    (0.0, 0.050, 2551, 502, (1590, 3543)),
    (0.9, 0.010, 150, 121, (13, 398)),
    (0.9, 0.050, 2551, 505, (1628, 3555)),
]


@pytest.mark.parametrize("row", MISMATCH)
def test_the_comparison_loss_of_9_4(row):
    tied, x1, mean, sd, ends = row
    variance = 0.005**2 * np.array([[1.0, tied], [tied, 1.0]])
    x = np.random.default_rng(3).multivariate_normal([x1, 0.0], variance, TRIALS)
    output = 1e6 * np.sum(x**2, axis=1)
    assert output.mean() == pytest.approx(mean, abs=1.5)
    assert output.std() == pytest.approx(sd, abs=1.2)
    # The shortest interval is flat at its best: its ends are known to few digits.
    assert shortest(output, 0.95) == pytest.approx(ends, abs=0.03 * sd + 1.0)
    parts = shares_of(output, {"x1": x[:, 0], "x2": x[:, 1]})
    linear = (1e6 * 2.0 * x1 * 0.005) ** 2
    assert sum(parts.values()) - parts["rest"] == pytest.approx(linear, rel=0.01)


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
