"""NUTS agrees with the closed form where there is one, at 14 to a million rows.

With E₀, α and ω₀ fixed, F = s ω + b + noise is linear in (K, b), whose normal priors
are conjugate: given σ the posterior is normal in closed form, and its evidence gives
the posterior of σ by quadrature on a line.
"""

import arviz_stats
import numpy as np
import pytest
from rigs import make_case, make_gear, make_records
from scipy import stats

from hdcal.calibration.calibrate import calibrate
from hdcal.data.priors import Prior
from hdcal.physics.theory import ring

MODULUS = 207e3
K, OFFSET, SIGMA = (2.5, 0.5), (0.0, 5.0), (0.5, 1.2)


def conjugate_case(rows: int):
    rng = np.random.default_rng(rows)
    deformation = rng.uniform(0.0, 0.54, rows)
    force = 205.0 * deformation - 3.0 + rng.normal(0.0, 0.9, rows)
    gear = make_gear(
        K=Prior("normal", K),
        E0=Prior("fixed", (MODULUS,)),
        alpha=Prior("fixed", (3e-4,)),
        deformation_offset=Prior("fixed", (0.0,)),
        force_offset=Prior("normal", OFFSET),
        sigma=Prior("lognormal", SIGMA),
        noise_correlation=Prior("fixed", (0.0,)),
    )
    return make_case(make_records(deformation, force), gear)


def exact_posterior(case):
    """Return means and sds of K, b and σ."""
    records = case.records
    unit = float(ring(case.gear.geometry, MODULUS))
    design = np.column_stack([unit * records.deformation, np.ones(len(records.force))])
    gram, cross = design.T @ design, design.T @ records.force
    square = records.force @ records.force
    mean0, precision0 = (
        np.array([K[0], OFFSET[0]]),
        np.diag([K[1] ** -2, OFFSET[1] ** -2]),
    )
    rest = records.force - design @ np.linalg.solve(gram, cross)
    guess = np.sqrt(rest @ rest / len(rest))
    grid = np.log(guess) + np.linspace(-6, 10, 4001) * max(
        0.7 / np.sqrt(len(rest)), 1e-4
    )
    log_weight, means, covariances = [], [], []
    for log_sigma in grid:
        variance = np.exp(2.0 * log_sigma)
        precision = precision0 + gram / variance
        covariance = np.linalg.inv(precision)
        mean = covariance @ (precision0 @ mean0 + cross / variance)
        fit = square / variance + mean0 @ precision0 @ mean0 - mean @ precision @ mean
        _, volume = np.linalg.slogdet(precision)
        evidence = -0.5 * (fit + volume) - len(rest) * log_sigma
        prior = stats.norm.logpdf(log_sigma, np.log(SIGMA[0]), SIGMA[1])
        log_weight.append(evidence + prior)
        means.append(mean)
        covariances.append(covariance)
    weight = np.exp(np.array(log_weight) - np.max(log_weight))
    weight /= weight.sum()
    means, sigma = np.array(means), np.exp(grid)
    centre = weight @ means
    spread = np.einsum("i,ijk->jk", weight, np.array(covariances))
    spread += np.einsum("i,ij,ik->jk", weight, means - centre, means - centre)
    of_sigma = weight @ sigma
    sds = [*np.sqrt(np.diag(spread)), np.sqrt(weight @ (sigma - of_sigma) ** 2)]
    pairs = zip([*centre, of_sigma], sds, strict=True)
    return dict(zip(("K", "force_offset", "sigma"), pairs, strict=True))


@pytest.mark.parametrize("rows", [14, 10_000, 1_000_000])
def test_means_and_sds_match_the_closed_form(rows):
    case = conjugate_case(rows)
    posterior = calibrate(case, seed=3)
    assert posterior.usable, posterior.reasons
    assert int(posterior.tree["sample_stats"]["diverging"].sum()) == 0
    group = posterior.tree["posterior"].to_dataset()
    for name, (mean, sd) in exact_posterior(case).items():
        found = group[name].to_numpy()
        error = found.std() / np.sqrt(posterior.diagnoses[name].ess_bulk)
        assert abs(found.mean() - mean) < 3.0 * error, (name, found.mean(), mean)
        assert found.std() == pytest.approx(sd, rel=0.05), name
        assert posterior.diagnoses[name].rhat <= 1.01
        least = float(arviz_stats.ess(group[[name]], method="tail")[name])
        assert min(posterior.diagnoses[name].ess_bulk, least) >= 1000


def test_a_wrong_closed_form_is_noticed():
    """The comparison can fail: leave the prior of K out of the exact answer."""
    case = conjugate_case(14)
    mean, sd = exact_posterior(case)["K"]
    unit = float(ring(case.gear.geometry, MODULUS))
    flat = np.polyfit(case.records.deformation, case.records.force, 1)[0] / unit
    assert abs(flat - mean) > 3.0 * sd / np.sqrt(4000)
