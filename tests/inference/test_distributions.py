"""Moments and ends of priors are those of SciPy's laws, which take long to import."""

import pytest

from hdcal.data.prior import FAMILIES, Prior
from hdcal.inference.distributions import bounds, frozen, moments

LAWS = {
    "normal": (3.0, 0.7),
    "lognormal": (2.0, 0.6),
    "half_normal": (1.3,),
    "uniform": (-1.0, 4.0),
    "beta": (0.5, 1.5),
}


@pytest.mark.parametrize("family", [name for name in FAMILIES if name != "fixed"])
def test_they_are_those_of_scipy(family: str):
    prior = Prior(family, LAWS[family])
    law = frozen(prior)
    assert moments(prior) == pytest.approx((law.mean(), law.std()), rel=1e-12)
    assert bounds(prior) == law.support()


def test_a_fixed_prior_has_no_spread():
    assert moments(Prior("fixed", (2.5,))) == (2.5, 0.0)
    with pytest.raises(ValueError, match="fixed"):
        bounds(Prior("fixed", (2.5,)))
