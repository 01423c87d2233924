"""An effect and something beside it that no library holds: both are told apart."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import NOISE, judged, rich, simulated
from scipy.stats import multivariate_normal

from hdcal.data.priors import effect_priors
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.remainder_evidence import (
    beside_effects,
    closed_by,
    with_remainders,
)
from hdcal.evidence.single_evidence import evidence_of_none
from hdcal.physics.registry import EFFECTS

FRICTION = {"coulomb_friction": {"force": 3.0}}
LIBRARY = {
    name: EFFECTS[name]
    for name in ("coulomb_friction", "progressive_stiffening", "thermal_zero_drift")
}


def waves(case, size: float):
    """Return the case with waves along the stroke that no effect has [N rms].

    They crowd together towards its end, as those of no screw do.
    """
    w = np.asarray(case.records.deformation)
    wave = size * np.sqrt(2.0) * np.sin(2.0 * np.pi * 4.0 * (w / np.max(w)) ** 2.5)
    return replace(case, records=replace(case.records, force=case.records.force + wave))


def evidence_of(case, library=LIBRARY):
    found = compute_evidence(case, library, effect_priors())
    return with_remainders(found, np.random.default_rng(0))


@pytest.mark.thorough
def test_friction_with_a_small_wave_is_friction_and_something_else():
    which = judged(waves(simulated(rich(), FRICTION, seed=1), 1.5 * NOISE)).which
    assert which.verdict == "group" and which.describes_best
    assert which.effect == "coulomb_friction"
    assert which.remainder is not None
    assert which.remainder.probability > 0.9
    # The wave is 0.6 N and the loop's visible half-width nearly 3 N.
    assert which.remainder.share.lo < 0.2 < which.remainder.share.hi + 0.05


def test_a_wave_with_a_little_friction_is_unknown():
    little = {"coulomb_friction": {"force": 0.4}}
    which = judged(waves(simulated(rich(), little, seed=1), 3.0)).which
    assert which.verdict == "unknown"


def test_what_a_loose_shape_explains_is_not_explained_again_by_a_remainder():
    """An amplifier drifts upwards: a leak could only sink, but for its loose shape."""
    drift = {"amplifier_drift": {"rate": 1.5e-3}}
    case = simulated(rich(), drift, seed=3)
    names = ("charge_leakage", "amplifier_drift", "relaxation")
    library = {name: EFFECTS[name] for name in names}
    found = evidence_of(case, library)
    likely = int(np.argmax(found.weight_of_correlations))
    sigma = found.prepared.priors["sigma"]
    loose = found.table["charge_leakage"][likely] - found.table["none"][likely]
    assert loose > 5.0
    for name in names:
        base = beside_effects(found, [name])
        beside = evidence_of_none(base.rows, sigma)[likely]
        # Nor is more explained than the effect can: a leak that rises is no leak.
        assert -3.0 < beside - found.table[name][likely] < 10.0, name
    closed = {name: np.median(share) for name, share in found.closed.items()}
    assert closed["amplifier_drift"] > 0.9
    assert max(closed["charge_leakage"], closed["relaxation"]) < 0.1


def test_without_a_remainder_there_is_little_probability_of_one():
    which = judged(simulated(rich(), FRICTION, seed=2)).which
    assert which.effect == "coulomb_friction"
    assert which.remainder is not None
    assert which.remainder.probability < 0.3


def test_an_effect_with_a_remainder_is_no_better_than_the_truth():
    """Where an effect alone made the readings, no other with a remainder beats it."""
    for seed in range(3):
        made = {"progressive_stiffening": {"slope": 0.3}}
        table = evidence_of(simulated(rich(), made, seed=seed)).table
        whole = {name: np.logaddexp.reduce(value) for name, value in table.items()}
        true = whole.pop("progressive_stiffening")
        assert max(whole.values()) < true + 2.0


@pytest.mark.parametrize("size", [0.0, 1.0])
def test_the_gain_is_that_of_a_dense_gaussian(size):
    """Beside a drift, one kernel alone: its evidence is a determinant of n rows."""
    from hdcal.evidence.inner_products import common_terms
    from hdcal.evidence.remainder_evidence import beside_effects
    from hdcal.evidence.single_evidence import evidence_of_none
    from hdcal.evidence.subspaces import evidence_of_subspaces

    case = waves(
        simulated(rich(), {"thermal_zero_drift": {"slope": 0.1}}, seed=4), size
    )
    evidence = compute_evidence(case, LIBRARY, effect_priors(), noise_sd=NOISE)
    beside = beside_effects(evidence, ["thermal_zero_drift"])
    name = "deformation"
    kernel = evidence.subspaces.columns[evidence.subspaces.of(name)[0]]
    rows = replace(beside.rows, correlations=np.zeros(1))
    beside = replace(beside, rows=rows)
    found = evidence_of_subspaces(beside, common_terms(rows), {}, {name: kernel})
    step, scale = 5, found.scale[0, 5]
    none = evidence_of_none(rows, beside.priors["sigma"])[0]
    gain = found.log_evidence[0, 0, step] - found.log_weight[0, step] - none
    # σ is integrated out there; here over a fine grid of the same prior.
    from hdcal.inference.distributions import frozen

    sd = np.exp(np.linspace(np.log(0.3), np.log(6.0), 160))
    prior = frozen(beside.priors["sigma"]).pdf(sd) * sd
    spread = rows.base @ np.diag(NOISE**2 / rows.precision) @ rows.base.T
    both = spread + scale**2 * kernel.T @ kernel

    def whole(covariance):
        # The base's priors go with the noise, as `LinearRows.precision` says.
        logs = [
            multivariate_normal(
                cov=s**2 * np.eye(len(spread)) + covariance(s), allow_singular=True
            ).logpdf(rows.reading)
            for s in sd
        ]
        return np.logaddexp.reduce(np.array(logs) + np.log(prior))

    without = whole(lambda s: (s / NOISE) ** 2 * spread)
    beside_it = whole(lambda s: (s / NOISE) ** 2 * spread + both - spread)
    assert gain == pytest.approx(beside_it - without, abs=0.1)


def test_the_share_that_effects_close():
    case = simulated(rich(), FRICTION | {"progressive_stiffening": {"slope": 0.1}})
    evidence = evidence_of(case)
    both = ("coulomb_friction", "progressive_stiffening")
    assert closed_by(evidence, both, both) == pytest.approx(1.0)
    assert closed_by(evidence, both, ()) == pytest.approx(0.0)
    assert 0.5 < closed_by(evidence, both, both[:1]) < 0.99
    # Noise moves the mean nowhere.
    assert closed_by(evidence, ("outliers",), ()) == 1.0
