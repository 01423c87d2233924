"""Noise that is correlated or grows is said; independent noise of one size is not."""

from dataclasses import replace

import equinox as eqx
import numpy as np
import pytest
from posteriors import regressed
from rigs import autoregression, make_records
from scipy import stats

import hdcal
from hdcal.calibration.calibration import calibration_of
from hdcal.inference.residual_noise import NEIGHBOURS, SCATTER, WILD, noise_faults
from hdcal.inference.residual_shapes import FALSE_ALARM, Whitened
from hdcal.inference.residuals import residuals

ROWS = 60
X = np.linspace(0.02, 0.54, ROWS)


def correlated(rho: float, rng, rows: int = ROWS, run=None) -> np.ndarray:
    """Return a first-order autoregression of sd 1, starting anew in each run."""
    run = np.zeros(rows, int) if run is None else run
    return autoregression(rng.normal(size=rows), run, rho)


def faults(error, *, run=None, rounded=False, mixed=False) -> list[str]:
    """Return what is said of errors beside which a line was absorbed."""
    records = make_records(X, **({} if run is None else {"run": run}))
    absorbed = np.column_stack([np.ones(len(error)), X])
    data = Whitened(error, absorbed, {})
    form = {"rounded": rounded, "mixed": mixed}
    found = noise_faults(data, records, np.ones(len(error)), **form)
    return [fault.name for fault in found]


def test_independent_noise_raises_few_false_alarms():
    rng = np.random.default_rng(1)
    alarms = sum(bool(faults(rng.normal(size=ROWS))) for _ in range(2000))
    assert stats.binomtest(alarms, 2000, FALSE_ALARM, "greater").pvalue > 1e-3


def test_the_moments_are_those_of_independent_noise():
    """p of the neighbours is uniform where nothing is wrong, in many short runs too."""
    rng, run = np.random.default_rng(2), np.repeat(np.arange(12), 5)
    records = make_records(X, run=run)
    own = (run[:, None] == np.arange(12)).astype(float)
    absorbed = np.column_stack([own, X])
    low = 0
    for _ in range(2000):
        data = Whitened(rng.normal(size=ROWS), absorbed, {})
        found = noise_faults(data, records, np.ones(ROWS), rounded=False)
        low += any(fault.name == NEIGHBOURS for fault in found)
    assert stats.binomtest(low, 2000, 0.5 * FALSE_ALARM, "greater").pvalue > 1e-3


def test_correlation_that_the_model_has_is_no_growth():
    rng, rows = np.random.default_rng(4), 200
    x = np.linspace(0.02, 0.54, rows)
    records, absorbed = make_records(x), np.column_stack([np.ones(rows), x])

    def alarms(noise) -> float:
        told = 0
        for _ in range(400):
            data = Whitened(noise(correlated(0.8, rng, rows)), absorbed, {})
            found = noise_faults(
                data, records, np.ones(rows), rounded=False, correlation=0.8
            )
            told += any(fault.name == SCATTER for fault in found)
        return told / 400

    # Half of 1 % each; of errors as they are it was 9 %.
    assert alarms(lambda error: error) < 0.025
    assert alarms(lambda error: error * (1.0 + 2.0 * x / x.max())) > 0.9


@pytest.mark.parametrize("run", [None, np.repeat(np.arange(3), 20)])
def test_correlated_noise_is_found(run):
    rng = np.random.default_rng(3)
    hits = [faults(correlated(0.6, rng, run=run), run=run) for _ in range(200)]
    assert np.mean([NEIGHBOURS in hit for hit in hits]) >= 0.9
    # Runs one after the other are no neighbours.
    apart = np.arange(ROWS)
    assert NEIGHBOURS not in faults(correlated(0.9, rng), run=apart)


def test_steps_wider_than_the_noise_are_no_correlation():
    rng = np.random.default_rng(4)
    assert NEIGHBOURS not in faults(correlated(0.9, rng), rounded=True)


def test_noise_in_proportion_to_the_force_is_found():
    rng = np.random.default_rng(5)
    x = np.tile(X, 3)
    records = make_records(x)
    absorbed = np.column_stack([np.ones(len(x)), x])
    hits = 0
    for _ in range(100):
        data = Whitened(rng.normal(size=len(x)) * x / x.mean(), absorbed, {})
        found = noise_faults(data, records, np.ones(len(x)), rounded=False)
        hits += any(fault.name == SCATTER for fault in found)
    assert hits >= 95


def test_the_factor_is_that_of_the_intervals():
    """Stated beside what least squares under the true covariance would say."""
    rng, factors = np.random.default_rng(6), []
    lag = np.abs(np.arange(ROWS)[:, None] - np.arange(ROWS))
    columns = np.column_stack([np.ones(ROWS), X])
    plain = np.linalg.inv(columns.T @ columns)
    true = plain @ columns.T @ 0.6**lag @ columns @ plain
    expected = np.sqrt(true[1, 1] / plain[1, 1])
    for _ in range(20):
        posterior = regressed(X, 200.0 * X + 0.5 * correlated(0.6, rng), rng, 400)
        factors += [
            float(fault.words.split("some ")[1].split(" times")[0])
            for fault in residuals(posterior).noise
            if fault.name == NEIGHBOURS
        ]
    assert len(factors) >= 15
    assert np.median(factors) == pytest.approx(expected, rel=0.25)


def test_every_answer_says_so():
    rng = np.random.default_rng(7)
    posterior = regressed(X, 200.0 * X + 0.5 * correlated(0.8, rng), rng, 400)
    found = hdcal.margin(posterior, 0.4)
    assert any("Neighbouring readings err alike" in said for said in found.remarks)
    answer = calibration_of(posterior)
    assert any("Neighbouring readings err alike" in said for said in answer.warnings)
    assert NEIGHBOURS in [shape.name for shape in answer.residuals]
    assert any("other mountings" in step for step in answer.next_steps)


def test_a_slip_of_writing_is_named_by_its_reading():
    rng = np.random.default_rng(8)
    for rho in (0.0, 0.8):
        error = correlated(rho, rng)
        error[ROWS // 3] += 60.0
        assert WILD in faults(error)
        assert WILD not in faults(error, mixed=True)
        error[ROWS // 3] -= 60.0
        assert WILD not in faults(error)


def test_noise_with_long_tails_is_seldom_a_slip():
    rng = np.random.default_rng(9)
    many = [WILD in faults(rng.standard_t(5, size=ROWS)) for _ in range(200)]
    assert np.mean(many) <= 0.03


def test_a_slip_is_the_first_thing_to_look_at():
    x = np.tile(np.linspace(0.05, 0.5, 30), 2)
    force = 200.0 * x + 0.3 * np.random.default_rng(2).normal(size=60)
    case = hdcal.read_case({"deformation_mm": x, "force_N": force})
    # after the screening, which would leave it out
    force[17] /= 10.0
    case = replace(case, records=eqx.tree_at(lambda r: r.force, case.records, force))
    found = calibration_of(hdcal.calibrate(case, warmup=300, draws=500))
    assert found.next_steps[0].startswith("Check that reading first")
    (told,) = [words for words in found.warnings if "as far as readings" in words]
    assert told.startswith(f"Reading 18, {force[17]:.4g} N at {x[17]:.4g} mm, lies ")
    off = float(told.partition("lies ")[2].partition(" N off")[0])
    assert off == pytest.approx(9.0 * force[17], rel=0.1)


@pytest.mark.parametrize("sd", [0.2, 0.25, 0.35])
def test_the_steps_of_a_display_are_no_slips(sd):
    rng = np.random.default_rng(4)
    force = [np.round(200.0 * X + rng.normal(0.0, sd, ROWS)) for _ in range(100)]
    line = np.column_stack([np.ones(ROWS), X])
    alarms = []
    for shown in force:
        error = shown - line @ np.linalg.lstsq(line, shown, rcond=None)[0]
        noise = float(np.std(error))
        data = Whitened(error / noise, line / noise, {})
        records = make_records(X, force=shown)
        found = noise_faults(data, records, np.full(ROWS, noise), rounded=False)
        alarms.append(WILD in {fault.name for fault in found})
    assert np.mean(alarms) <= 0.02


def test_many_jumps_are_no_slips():
    error = correlated(0.0, np.random.default_rng(5))
    error[10:60:10] += 50.0
    assert WILD not in faults(error)
