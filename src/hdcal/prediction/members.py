"""Forces of the members of a population: normal components within each draw."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr, ndtri

# Precision of a quantile [N].
_CLOSE = 1e-7
# A member without scatter still needs a width [N]: far below any reading.
_LEAST_SD = 1e-9


@dataclass(frozen=True)
class Members:
    """Forces of the members at n conditions, along the direction of loading.

    What is unknown but the same for all members (parameters, centre of the population,
    bend, drift of the rig) has one value in each draw. What differs from member to
    member (gear, mounting, sizes, noise) is a law within the draw: normal components.

    Attributes:
        weight: of each draw, (draw,).
        share: of each component within its draw, (draw, component).
        mean: of the components [N], (draw, row, component).
        sd: of the components [N], (draw, row, component).
        scatter: variance between members by source [N²], (draw, row).
        common: inputs that all members share, (draw, row).
    """

    weight: np.ndarray
    share: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    scatter: dict[str, np.ndarray] = field(default_factory=dict)
    common: dict[str, np.ndarray] = field(default_factory=dict)

    def row(self, place: int) -> "Members":
        """Return the members at one of the conditions."""
        one = slice(place, place + 1)
        return Members(
            self.weight,
            self.share,
            self.mean[:, one],
            self.sd[:, one],
            {name: value[:, one] for name, value in self.scatter.items()},
            {name: value[:, one] for name, value in self.common.items()},
        )

    def thinned(self, most: int) -> "Members":
        """Return at most so many draws, taken evenly; without sources of scatter."""
        count = len(self.weight)
        kept = np.linspace(0, count - 1, min(most, count)).round().astype(int)
        return Members(
            self.weight[kept], self.share[kept], self.mean[kept], self.sd[kept]
        )

    @property
    def centre(self) -> np.ndarray:
        """Mean force of each draw [N], (draw, row)."""
        return np.einsum("dk,drk->dr", self.share, self.mean)

    def above(self, force: np.ndarray | float) -> np.ndarray:
        """Return the share of the members of each draw above a force, (draw, row).

        Args:
            force: along the direction of loading [N], (draw, row) or less.
        """
        room = self.mean - np.asarray(force)[..., None]
        tail = ndtr(room / np.maximum(self.sd, _LEAST_SD))
        return np.einsum("dk,drk->dr", self.share, tail)

    def quantile(self, level: float) -> np.ndarray:
        """Return the force that this share of the members does not exceed [N].

        Returns:
            Shape (draw, row).
        """
        each = self.mean + ndtri(level) * self.sd
        if each.shape[2] == 1:
            return each[:, :, 0]
        from scipy.optimize.elementwise import find_root

        share, mean, sd = (
            np.broadcast_to(values, each.shape).reshape(-1, each.shape[2])
            for values in (self.share[:, None], self.mean, self.sd)
        )

        def excess(force, row):
            room = (mean[row] - force[..., None]) / np.maximum(sd[row], _LEAST_SD)
            return (1.0 - level) - np.sum(share[row] * ndtr(room), axis=-1)

        # The quantile of a mixture lies between those of its components.
        ends = each.min(axis=2).ravel() - _CLOSE, each.max(axis=2).ravel() + _CLOSE
        found = find_root(
            excess, ends, args=(np.arange(len(mean)),), tolerances={"xatol": _CLOSE}
        )
        return found.x.reshape(each.shape[:2])

    def sample(self, levels: np.ndarray, score: np.ndarray) -> np.ndarray:
        """Return one member of each draw [N], (draw, row).

        The same member at every row, so that a curve of its quantiles is smooth.

        Args:
            levels: selects a component by its share, between 0 and 1, (draw,).
            score: place within it, standard normal, (draw,).
        """
        ends = np.cumsum(self.share, axis=1)[:, :-1]
        one = np.sum(ends < levels[:, None], axis=1)
        rows = np.arange(len(one))
        return self.mean[rows, :, one] + self.sd[rows, :, one] * score[:, None]


def joined(parts: Sequence[Members]) -> Members:
    """Return the draws of several models as those of one.

    Components that a model lacks have no share, and scatter has no sources.
    """
    if len(parts) == 1:
        return parts[0]
    most = max(part.share.shape[1] for part in parts)

    def padded(values: np.ndarray) -> np.ndarray:
        extra = [(0, 0)] * (values.ndim - 1) + [(0, most - values.shape[-1])]
        # With the values of another component, so that no quantile is affected.
        return np.pad(values, extra, mode="edge")

    share = [
        np.pad(part.share, ((0, 0), (0, most - part.share.shape[1]))) for part in parts
    ]
    return Members(
        np.concatenate([part.weight for part in parts]),
        np.concatenate(share),
        np.concatenate([padded(part.mean) for part in parts]),
        np.concatenate([padded(part.sd) for part in parts]),
        {},
        {
            name: np.concatenate([part.common[name] for part in parts])
            for name in set.intersection(*(set(part.common) for part in parts))
        },
    )


def one_member(members: Members, more_sd: float = 0.0) -> Members:
    """Return the law of one member over all draws, as one draw.

    Args:
        members: of all models.
        more_sd: of what is added to each, such as rounding [N].
    """
    rows = members.mean.shape[1]
    share = (members.weight[:, None] * members.share).reshape(1, -1)

    def flat(values: np.ndarray) -> np.ndarray:
        return np.moveaxis(values, 1, 0).reshape(1, rows, -1)

    sd = np.hypot(flat(members.sd), more_sd)
    return Members(np.ones(1), share, flat(members.mean), sd)


def over_draws(values: np.ndarray, weight: np.ndarray, levels) -> np.ndarray:
    """Return weighted quantiles over draws, (level, row).

    Args:
        values: finite, shape (draw, row).
        weight: of the draws, (draw,).
        levels: shares of the weight below.
    """
    # What is contiguous in memory is sorted several times as fast.
    rows = np.ascontiguousarray(values.T)
    if np.ptp(weight) == 0.0:
        return np.quantile(rows, levels, axis=1, method="hazen")
    found = []
    for row in rows:
        order = np.argsort(row)
        own = weight[order]
        place = (np.cumsum(own) - 0.5 * own) / own.sum()
        found.append(np.interp(levels, place, row[order]))
    return np.stack(found, axis=1)
