"""Groups about their mean: the law of their contrasts is exact in any coordinates."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro.handlers import seed
from numpyro.infer.util import log_density
from scipy.stats import multivariate_normal

from hdcal.fleets.groupings import group_offsets, grouping, sample_offsets


@pytest.fixture(autouse=True)
def in_double_precision():
    jax.config.update("jax_enable_x64", True)


@pytest.mark.parametrize("sd", [1e-4, 0.3, 20.0])
@pytest.mark.parametrize("means", [(1.0, 2.0), (0.1, -0.3, 4.0)])
def test_the_density_is_that_of_normal_offsets(sd, means):
    """p(u) = N(c; 0, sd²) |dc/du| in the contrasts c of the offsets."""
    groups = grouping(np.array(means), np.diag(np.linspace(0.01, 0.5, len(means))))
    u = np.linspace(-0.7, 1.1, len(means) - 1)
    data = {f"_lot_{k + 1}": value for k, value in enumerate(u)}
    found, trace = log_density(seed(sample_offsets, 0), ("lot", groups, sd), {}, data)
    values = {n: site["value"] for n, site in trace.items() if not n.startswith("_")}
    offsets = np.asarray(group_offsets(values, "lot"))
    contrast = groups.basis.T @ offsets
    weight = sd**2 / (sd**2 + groups.variance)
    widths = np.sqrt(weight * groups.variance)
    law = multivariate_normal(np.zeros(len(u)), sd**2)
    expected = law.logpdf(contrast) + np.log(widths).sum()
    assert found == pytest.approx(expected, rel=1e-9)
    assert offsets.sum() == pytest.approx(0.0, abs=1e-9)
    # Of a large scatter they are where the estimates are, of a small one together.
    apart = np.array(means) - np.mean(means)
    if sd == 20.0:
        np.testing.assert_allclose(offsets, apart, atol=1.5)
    if sd == 1e-4:
        np.testing.assert_allclose(offsets, 0.0, atol=1e-3)


def test_where_no_groups_are_told_all_are_at_the_mean():
    assert group_offsets({"stiffness": jnp.ones(7)}, "lot").shape == (1, 7)
    assert group_offsets({"stiffness": 200.0}, "lot").tolist() == [0.0]
