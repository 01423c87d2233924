"""Forces of the members of a population: normal components within each draw."""

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
    bend, drift of the rig) has one value in each draw, (draw, row): `common`. What
    differs from member to member (gear, mounting, sizes, noise) has normal components
    within each draw: share (draw, component), mean and sd [N] (draw, row, component);
    `scatter` is their variance by source [N²], (draw, row).
    """

    share: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    scatter: dict[str, np.ndarray] = field(default_factory=dict)
    common: dict[str, np.ndarray] = field(default_factory=dict)

    def row(self, place: int) -> "Members":
        """Return the members at one of the conditions."""
        row = slice(place, place + 1)
        return Members(
            self.share,
            self.mean[:, row],
            self.sd[:, row],
            {name: value[:, row] for name, value in self.scatter.items()},
            {name: value[:, row] for name, value in self.common.items()},
        )

    @property
    def centre(self) -> np.ndarray:
        """Mean force of each draw [N], (draw, row)."""
        return np.einsum("dk,drk->dr", self.share, self.mean)

    def above(self, force: float) -> np.ndarray:
        """Return the share of the members of each draw above a force, (draw, row)."""
        tail = ndtr((self.mean - force) / np.maximum(self.sd, _LEAST_SD))
        return np.einsum("dk,drk->dr", self.share, tail)

    def quantile(self, level: np.ndarray | float) -> np.ndarray:
        """Return the force that a share of the members does not exceed, (draw, row).

        The level is that share, one for all draws or (draw,).
        """
        draws, rows, components = self.mean.shape
        level = np.broadcast_to(np.reshape(level, (-1, 1)), (draws, rows))
        each = self.mean + ndtri(level)[..., None] * self.sd
        if components == 1:
            return each[:, :, 0]
        from scipy.optimize.elementwise import find_root

        share, mean, sd = (
            np.broadcast_to(values, each.shape).reshape(-1, components)
            for values in (self.share[:, None], self.mean, self.sd)
        )
        beyond = 1.0 - level.ravel()

        def excess(force, row):
            room = (mean[row] - force[..., None]) / np.maximum(sd[row], _LEAST_SD)
            return beyond[row] - np.sum(share[row] * ndtr(room), axis=-1)

        # The quantile of a mixture lies between those of its components.
        ends = each.min(axis=2).ravel() - _CLOSE, each.max(axis=2).ravel() + _CLOSE
        found = find_root(
            excess, ends, args=(np.arange(len(mean)),), tolerances={"xatol": _CLOSE}
        )
        return found.x.reshape(draws, rows)


def one_member(members: Members, more_sd: float = 0.0) -> Members:
    """Return one member over all draws, as one draw, with more scatter [N]."""
    draws, rows, _ = members.mean.shape

    def flat(values: np.ndarray) -> np.ndarray:
        return np.moveaxis(values, 1, 0).reshape(1, rows, -1)

    share = members.share.reshape(1, -1) / draws
    return Members(share, flat(members.mean), np.hypot(flat(members.sd), more_sd))


def over_draws(values: np.ndarray, levels) -> np.ndarray:
    """Return quantiles over draws, (level, row), of values (draw, row)."""
    # What is contiguous in memory is sorted several times as fast.
    rows = np.ascontiguousarray(values.T)
    return np.quantile(rows, levels, axis=1, method="hazen")
