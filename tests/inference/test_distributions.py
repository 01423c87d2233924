"""Laws, moments and ends of priors are SciPy's, which take long to import."""

import numpy as np
import pytest
from scipy import stats

from hdcal.data.prior import FAMILIES, Prior
from hdcal.inference.distributions import bounds, frozen, moments

LAWS = {
    "normal": ((3.0, 0.7), stats.norm(3.0, 0.7)),
    "lognormal": ((2.0, 0.6), stats.lognorm(0.6, scale=2.0)),
    "half_normal": ((1.3,), stats.halfnorm(scale=1.3)),
    "uniform": ((-1.0, 4.0), stats.uniform(-1.0, 5.0)),
    "beta": ((0.5, 1.5), stats.beta(0.5, 1.5)),
}
SHARES = np.array([0.0, 1e-12, 0.003, 0.2, 0.5, 0.9, 1.0 - 1e-9, 1.0])


@pytest.mark.parametrize("family", [name for name in FAMILIES if name != "fixed"])
def test_they_are_those_of_scipy(family: str):
    numbers, wanted = LAWS[family]
    prior = Prior(family, numbers)
    law = frozen(prior)
    assert moments(prior) == pytest.approx((wanted.mean(), wanted.std()), rel=1e-12)
    assert bounds(prior) == wanted.support()
    np.testing.assert_allclose(law.ppf(SHARES), wanted.ppf(SHARES), rtol=1e-12)
    assert law.median() == pytest.approx(wanted.median(), rel=1e-12)
    assert law.interval(0.997) == pytest.approx(wanted.interval(0.997), rel=1e-12)
    # Beyond the ends, at them, and where hardly anything lies.
    x = np.array([-1e3, -2.0, -1.0, 0.0, 1e-3, 0.5, 1.0, 3.0, 5.0, 9.0, 40.0])
    for name in ("cdf", "sf", "pdf", "logpdf"):
        got, known = getattr(law, name)(x), getattr(wanted, name)(x)
        np.testing.assert_allclose(got, known, rtol=1e-11, atol=1e-300, err_msg=name)


def test_a_fixed_prior_has_no_spread():
    assert moments(Prior("fixed", (2.5,))) == (2.5, 0.0)
    for call in (bounds, frozen):
        with pytest.raises(ValueError, match="fixed"):
            call(Prior("fixed", (2.5,)))
