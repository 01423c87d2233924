"""Wrong evidences are caught by small calibration checks that the right ones pass."""

from functools import cache

import numpy as np
import pytest
from diagnosis_cases import simulated
from rigs import cycles
from scipy import stats
from slices import slice_of

from hdcal.data.priors import effect_priors
from hdcal.diagnosis.model_posterior import log_priors, model_posterior
from hdcal.evidence import prepare as prepare_module
from hdcal.evidence.case_evidence import NONE
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.linear_rows import CORRELATIONS
from hdcal.inference.distributions import frozen
from hdcal.physics.effect import parameters
from hdcal.physics.registry import EFFECTS

# Small, tight library of different looks: cheap, and evidences decide.
NAMES = (
    "coulomb_friction",
    "thermal_zero_drift",
    "progressive_stiffening",
    "amplifier_drift",
)
LIBRARY = {name: EFFECTS[name] for name in NAMES}
ROWS = 48
LEVEL = 1e-3


def probabilities(case) -> dict[str, float]:
    evidence = compute_evidence(case, LIBRARY, effect_priors())
    return model_posterior(evidence.table).probabilities


def shares(case) -> dict[str, float]:
    """Return probabilities of none and each effect, given that it is one of them."""
    found = probabilities(case)
    known = {name: found.get(name, 0.0) for name in (NONE, *NAMES)}
    total = sum(known.values())
    return {name: share / total for name, share in known.items()}


@cache
def alarms(correlation: float, count: int) -> int:
    """Return how often noise of this correlation is given a cause at evens or more."""
    cases = (
        simulated(cycles(ROWS), seed=i, correlation=correlation)
        for i in range(100, 100 + count)
    )
    return sum(probabilities(case)[NONE] < 0.5 for case in cases)


@pytest.mark.parametrize("correlation", slice_of([0.0, 0.5], [0.5]))
def test_noise_seldom_alarms(correlation):
    assert stats.binomtest(alarms(correlation, 25), 25, 0.05, "greater").pvalue > LEVEL


def test_evidences_that_know_no_serial_noise_alarm():
    # As many as before: arguments of what is compiled, and nothing is compiled anew.
    none = (0.0,) * len(CORRELATIONS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prepare_module, "CORRELATIONS", none)
        found = alarms.__wrapped__(0.5, 40)
    assert stats.binomtest(found, 40, 0.05, "greater").pvalue < LEVEL, found


def drawn(seed: int):
    """Draw a hypothesis, its parameters and readings from the prior."""
    rng = np.random.default_rng(seed)
    names = ["none", *NAMES]
    # As the priors weigh them, less what is neither.
    chance = np.exp(log_priors(["none", "unknown", *NAMES]))[[0, *range(2, 6)]]
    name = names[rng.choice(len(names), p=chance / chance.sum())]
    if name == NONE:
        return name, simulated(cycles(ROWS), seed=seed)
    priors = effect_priors()
    scale = rng.choice([1.0 / 3.0, 1.0, 3.0], p=[0.25, 0.5, 0.25])
    values = {}
    for field, about in parameters(EFFECTS[name]).items():
        value = float(frozen(priors[f"{name}.{field}"]).ppf(rng.random()))
        values[field] = value * (scale if about.null is not None else 1.0)
    return name, simulated(cycles(ROWS), {name: values}, seed=seed)


@cache
def predictive(count: int):
    """Return the truth of each case and the probabilities found, as an array."""
    found = [drawn(seed) for seed in range(1000, 1000 + count)]
    names = (NONE, *NAMES)
    truth = np.array([names.index(name) for name, _ in found])
    each = [shares(case) for _, case in found]
    return truth, np.array([[share[name] for name in names] for share in each])


def sharpened(table, power: float):
    raised = np.maximum(table, 1e-12) ** power
    return raised / raised.sum(axis=1, keepdims=True)


def surprise(truth, table, turns: int = 4999) -> float:
    """Return the p value that probabilities are not too bold.

    The log score of the truth among those of truths drawn from the probabilities:
    exact, whatever the law of the score.
    """
    logs, rows = np.log(np.maximum(table, 1e-12)), np.arange(len(truth))
    place = np.random.default_rng(0).uniform(size=(turns, len(truth)))
    drawn_truth = np.sum(place[..., None] > np.cumsum(table, axis=1)[:, :-1], axis=-1)
    scores = logs[rows, drawn_truth].sum(axis=1)
    return float((1 + np.sum(scores <= logs[rows, truth].sum())) / (1 + turns))


def reliability(truth, table) -> float:
    """Return the p value that the likeliest is true as often as it is promised."""
    top = table.argmax(axis=1)
    chance = table[np.arange(len(top)), top]
    hit = top == truth
    z = (hit.sum() - chance.sum()) / np.sqrt(np.sum(chance * (1.0 - chance)) + 0.25)
    return float(2.0 * stats.norm.sf(abs(z)))


def assert_calibrated(truth, table):
    assert surprise(truth, table) > LEVEL
    assert reliability(truth, table) > LEVEL


def test_a_slice_of_probabilities_is_calibrated():
    truth, table = predictive(70)
    assert_calibrated(truth, table)
    assert surprise(truth, sharpened(table, 3.0)) < LEVEL


@pytest.mark.slow
def test_probabilities_are_calibrated():
    assert_calibrated(*predictive(150))


@pytest.mark.slow
@pytest.mark.parametrize("power", [3.0, 1.0 / 3.0])
def test_sharpened_and_blunted_probabilities_are_caught(power):
    truth, table = predictive(150)
    wrong = sharpened(table, power)
    assert min(surprise(truth, wrong), reliability(truth, wrong)) < LEVEL


def test_the_checks_themselves_know_bold_from_shy():
    """On make-believe probabilities, truth drawn from them."""
    rng = np.random.default_rng(3)
    table = rng.dirichlet(np.ones(4), size=150)
    truth = np.array([rng.choice(4, p=row) for row in table])
    assert_calibrated(truth, table)
    assert surprise(truth, sharpened(table, 3.0)) < LEVEL
    assert reliability(truth, sharpened(table, 3.0)) < LEVEL
    assert reliability(truth, sharpened(table, 1.0 / 3.0)) < LEVEL
