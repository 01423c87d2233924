import jax
import numpy as np
import pytest
from scipy import stats

from hdcal.data.prior import FAMILIES, Prior
from hdcal.inference.distributions import (
    distribution,
    frozen,
    moments,
    sample_prior,
)

NUMBERS = {
    "normal": (3.0, 0.7),
    "lognormal": (2.0, 0.6),
    "half_normal": (1.3,),
    "uniform": (-1.0, 4.0),
    "beta": (0.5, 1.5),
}


@pytest.mark.parametrize(
    ("family", "name"),
    [*((name, "K") for name in FAMILIES if name != "fixed"), ("normal", "sigma")],
)
def test_both_forms_are_the_same_distribution(family: str, name: str):
    prior = Prior(family, NUMBERS[family])
    known = frozen(prior, name)
    x = known.ppf([0.01, 0.3, 0.9])
    with jax.enable_x64(True):
        density = distribution(prior, name).log_prob(x)
    np.testing.assert_allclose(density, known.logpdf(x), rtol=1e-10)
    drawn = sample_prior(prior, name, np.random.default_rng(0), 2000)
    assert stats.kstest(drawn, known.cdf).pvalue > 0.001


def test_a_normal_prior_of_a_positive_parameter_is_truncated_at_zero():
    prior = Prior("normal", (1.0, 2.0))
    assert frozen(prior, "sigma").support() == (0.0, np.inf)
    assert frozen(prior, "K").support() == (-np.inf, np.inf)
    whole = stats.norm(1.0, 2.0)
    assert frozen(prior, "sigma").cdf(1.0) == pytest.approx(
        (whole.cdf(1.0) - whole.cdf(0.0)) / whole.sf(0.0)
    )
    mean, sd = moments(prior, "sigma")
    assert mean > 1.0
    assert sd < 2.0


def test_a_fixed_prior_has_no_spread():
    fixed = Prior("fixed", (2.5,))
    assert moments(fixed) == (2.5, 0.0)
    assert (sample_prior(fixed, "K", np.random.default_rng(0), 3) == 2.5).all()
    for call in (distribution, frozen):
        with pytest.raises(ValueError, match="fixed"):
            call(fixed)
