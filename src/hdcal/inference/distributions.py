"""From a prior table to NumPyro's distributions, and to laws that NumPy evaluates."""

import math
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from hdcal.data.priors import Prior

if TYPE_CHECKING:
    import numpyro.distributions as dist


# Ends of the support by family; a uniform law has its own.
_SUPPORTS = {
    "normal": (-math.inf, math.inf),
    "lognormal": (0.0, math.inf),
    "half_normal": (0.0, math.inf),
    "beta": (0.0, 1.0),
}


def distribution(prior: Prior, *, positive: bool = False) -> "dist.Distribution":
    """Return the distribution of a prior that is not fixed.

    Args:
        prior: family and numbers.
        positive: cut a normal prior at zero (a modulus cannot be negative).
    """
    # Late: what was traced before needs none.
    import numpyro.distributions as dist

    numbers = prior.numbers
    match prior.family:
        case "normal" if positive:
            return dist.TruncatedNormal(numbers[0], numbers[1], low=0.0)
        case "normal":
            return dist.Normal(numbers[0], numbers[1])
        case "lognormal":
            return dist.LogNormal(jnp.log(numbers[0]), numbers[1])
        case "half_normal":
            return dist.HalfNormal(numbers[0])
        case "uniform":
            return dist.Uniform(numbers[0], numbers[1])
        case "beta":
            return dist.Beta(numbers[0], numbers[1])
    raise ValueError(f"no distribution for the prior family {prior.family!r}")


class PriorLaw(NamedTuple):
    """A prior as a law that NumPy evaluates: `scipy.stats` takes 0.3 s to import.

    All but a beta law are functions of a standard normal or uniform variable.
    """

    family: str
    numbers: tuple[float, ...]

    def cdf(self, x: ArrayLike) -> np.ndarray:
        """Return the probability below, of the shape of `x`."""
        return self._tail(np.asarray(x, float), below=True)

    def sf(self, x: ArrayLike) -> np.ndarray:
        """Return the probability above, exact where it is next to nothing."""
        return self._tail(np.asarray(x, float), below=False)

    def ppf(self, share: ArrayLike) -> np.ndarray:
        """Return the values below which shares lie, of the shape of `share`."""
        q, (first, *others) = np.asarray(share, float), self.numbers
        match self.family:
            case "normal":
                return first + others[0] * special.ndtri(q)
            case "lognormal":
                return first * np.exp(others[0] * special.ndtri(q))
            case "half_normal":
                return first * special.ndtri(0.5 * (1.0 + q))
            case "uniform":
                return first + (others[0] - first) * q
        return special.betaincinv(first, others[0], q)

    def pdf(self, x: ArrayLike) -> np.ndarray:
        """Return the density, of the shape of `x`."""
        return np.exp(self.logpdf(x))

    def logpdf(self, x: ArrayLike) -> np.ndarray:
        """Return the log of the density, of the shape of `x`; −∞ beyond the ends."""
        x, (first, *others) = np.asarray(x, float), self.numbers
        low, high = _SUPPORTS.get(self.family, self.numbers)
        inside = np.where((x < low) | (x > high), np.nan, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            match self.family:
                case "uniform":
                    density = 0.0 * inside - np.log(high - low)
                case "beta":
                    density = special.xlogy(first - 1.0, inside)
                    density += special.xlog1py(others[0] - 1.0, -inside)
                    density -= special.betaln(first, others[0])
                case family:
                    sd = others[0] if others else first
                    density = -0.5 * self._score(inside) ** 2 - np.log(sd)
                    density -= 0.5 * np.log(2.0 * np.pi)
                    if family == "half_normal":
                        density += np.log(2.0)
                    if family == "lognormal":
                        density = np.where(x > 0.0, density - np.log(inside), np.nan)
        return np.where(np.isnan(density), -np.inf, density)

    def median(self) -> float:
        """Return the value that as much lies below as above."""
        return float(self.ppf(0.5))

    def interval(self, share: float) -> tuple[float, float]:
        """Return the ends between which a share lies, as much beyond either."""
        low, high = self.ppf(0.5 + 0.5 * share * np.array([-1.0, 1.0]))
        return float(low), float(high)

    def _score(self, x: np.ndarray) -> np.ndarray:
        """Return the standard normal variable."""
        first, *others = self.numbers
        if self.family == "lognormal":
            with np.errstate(divide="ignore"):
                return np.log(np.maximum(x, 0.0) / first) / others[0]
        return (x - first) / others[0] if others else np.maximum(x, 0.0) / first

    def _tail(self, x: np.ndarray, *, below: bool) -> np.ndarray:
        side = 1.0 if below else -1.0
        match self.family:
            case "uniform":
                low, high = self.numbers
                share = np.clip((x - low) / (high - low), 0.0, 1.0)
                return share if below else 1.0 - share
            case "beta":
                share = special.betainc if below else special.betaincc
                return share(*self.numbers, np.clip(x, 0.0, 1.0))
            case "half_normal":
                score = self._score(x)
                inside = special.erf(score / np.sqrt(2.0))
                return inside if below else 2.0 * special.ndtr(-score)
        return special.ndtr(side * self._score(x))


def frozen(prior: Prior) -> PriorLaw:
    """Return the law of a prior that is not fixed."""
    if prior.family not in (*_SUPPORTS, "uniform"):
        raise ValueError(f"no distribution for the prior family {prior.family!r}")
    return PriorLaw(prior.family, tuple(float(number) for number in prior.numbers))


def bounds(prior: Prior) -> tuple[float, float]:
    """Return the ends of the prior's support."""
    if prior.family == "uniform":
        return float(prior.numbers[0]), float(prior.numbers[1])
    if prior.family in _SUPPORTS:
        return _SUPPORTS[prior.family]
    raise ValueError(f"no distribution for the prior family {prior.family!r}")


def moments(prior: Prior) -> tuple[float, float]:
    """Return mean and sd of a prior, in its own unit."""
    first, *others = (float(number) for number in prior.numbers)
    second = others[0] if others else 0.0
    match prior.family:
        case "fixed" | "normal":
            return first, second
        case "lognormal":
            mean = first * math.exp(0.5 * second**2)
            return mean, mean * math.sqrt(math.expm1(second**2))
        case "half_normal":
            return first * math.sqrt(2.0 / math.pi), first * math.sqrt(
                1.0 - 2.0 / math.pi
            )
        case "uniform":
            return 0.5 * (first + second), (second - first) / math.sqrt(12.0)
        case "beta":
            both = first + second
            return first / both, math.sqrt(first * second / (both + 1.0)) / both
    raise ValueError(f"no distribution for the prior family {prior.family!r}")
