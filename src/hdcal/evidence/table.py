"""All hypotheses of a case with their prior and their evidence."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Part

OUTSIDE = "outside"
# Names of the components of a hypothesis on the mean reading, sorted; () is none.
Names = tuple[str, ...]
# Prior probabilities of none, of the remainder alone, of all effects with it, of all
# pairs, and of all pairs with it. Single effects share what is left. A larger share of
# pairs makes true pairs more probable, and takes as much from effects with structure
# outside the library: blind cases with both get worse.
_NONE, _REMAINDER, _WITH_REMAINDER, _PAIRS, _PAIRS_WITH = 0.5, 0.1, 0.15, 0.03, 0.01
_SINGLE = 1.0 - (_NONE + _REMAINDER + _WITH_REMAINDER + _PAIRS + _PAIRS_WITH)


@dataclass
class EvidenceTable:
    """Log evidence of hypotheses on the mean reading, by model of the noise.

    The remainder is the last name. Evidences contain the priors of the noises; `parts`
    are the components of each hypothesis at their most probable items.
    """

    names: tuple[str, ...]
    noises: list[NoiseModel]
    log_evidence: dict[Names, Float[np.ndarray, " m"]] = field(default_factory=dict)
    parts: dict[Names, list[Part]] = field(default_factory=dict)

    def log_prior(self, key: Names) -> float:
        """Return the log prior probability of a hypothesis on the mean reading."""
        effects = max(len(self.names) - 1, 1)
        pairs = max(effects * (effects - 1) // 2, 1)
        alone = (_NONE, _SINGLE / effects, _PAIRS / pairs)
        with_it = (_REMAINDER, _WITH_REMAINDER / effects, _PAIRS_WITH / pairs)
        shares = with_it if OUTSIDE in key else alone
        return float(np.log(shares[len(key) - (OUTSIDE in key)]))

    def posterior(self, temperature: float = 1.0) -> dict[Names, np.ndarray]:
        """Return the probability of each hypothesis and model of the noise.

        Log evidences of hypotheses are divided by the temperature.
        """
        table = np.stack([*self.log_evidence.values()])
        prior = np.array([self.log_prior(key) for key in self.log_evidence])
        whole = np.logaddexp.reduce(table, axis=1)
        log_odds = (whole - whole.max()) / temperature + prior
        joint = np.exp(log_odds[:, None] + table - whole[:, None])
        return dict(zip(self.log_evidence, joint / joint.sum(), strict=True))

    def ranked(self, size: int | None = None) -> list[Names]:
        """Return hypotheses, or those of so many components, likeliest first."""
        chance = {
            key: float(each.sum())
            for key, each in self.posterior().items()
            if size in (None, len(key))
        }
        return sorted(chance, key=lambda key: chance[key], reverse=True)

    def noise_probabilities(self) -> Float[np.ndarray, " m"]:
        """Return the probability of each model of the noise."""
        return np.sum([*self.posterior().values()], axis=0)

    def likeliest_noise(self, key: Names) -> NoiseModel:
        """Return the most probable model of the noise for a hypothesis."""
        return self.noises[int(np.argmax(self.log_evidence[key]))]

    def put(
        self, names: Names, column: int, value: float, parts: Callable[[], list[Part]]
    ) -> None:
        """Enter an evidence, and its components if it is the largest bound so far."""
        key = tuple(sorted(names))
        none = np.full(len(self.noises), -np.inf)
        row = self.log_evidence.setdefault(key, none)
        if value > row.max():
            self.parts[key] = parts()
        row[column] = max(row[column], float(value))

    def add_noises(self, noises: list[NoiseModel]) -> None:
        """Add models of the noise, under which nothing is evaluated yet."""
        self.noises += noises
        none = np.full(len(noises), -np.inf)
        self.log_evidence = {
            key: np.append(row, none) for key, row in self.log_evidence.items()
        }
