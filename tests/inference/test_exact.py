"""NUTS agrees with the closed form where there is one, at 14 to a million rows."""

import arviz_stats
import numpy as np
import pytest
from conjugate import conjugate_case, known_posterior
from slices import slice_of

from hdcal.calibration.calibrate import calibrate


def case_of(rows: int):
    rng = np.random.default_rng(rows)
    deformation = rng.uniform(0.0, 0.54, rows)
    force = 205.0 * deformation - 3.0 + rng.normal(0.0, 0.9, rows)
    return conjugate_case(deformation, force)


def exact_posterior(case):
    """Return means and sds of K, b and σ."""
    known = known_posterior(case)
    centre = known.weight @ known.mean
    spread = np.einsum("i,ijk->jk", known.weight, known.covariance)
    off = known.mean - centre
    spread += np.einsum("i,ij,ik->jk", known.weight, off, off)
    of_sigma = known.weight @ known.sigma
    of_sigma_sd = np.sqrt(known.weight @ (known.sigma - of_sigma) ** 2)
    sds = [*np.sqrt(np.diag(spread)), of_sigma_sd]
    pairs = zip([*centre, of_sigma], sds, strict=True)
    return dict(zip(("K", "force_offset", "sigma"), pairs, strict=True))


@pytest.mark.parametrize("rows", slice_of([14, 10_000, 1_000_000], [14]))
def test_means_and_sds_match_the_closed_form(rows):
    case = case_of(rows)
    posterior = calibrate(case, seed=3, warmup=300, draws=3000)
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
