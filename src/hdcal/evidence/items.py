"""Items of which hypotheses are made: atoms and spaces, both linear.

An atom is one curve, offset + slope · a, with a prior of the amplitude a that is normal
or flat in an interval. A space is a set of columns of which all coefficients have one
prior sd.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

# Factors on the prior sd of a space whose size is unknown, and its most columns.
STEPS = 2.0 ** np.arange(-5.0, 5.0)
MOST_COLUMNS = 24


class Amplitudes(NamedTuple):
    """Priors of the amplitudes of items.

    The density is exp(log_height − precision · (a − mean)² / 2) from low to high; a
    precision of 0 makes it flat.
    """

    low: Float[np.ndarray, " m"]
    high: Float[np.ndarray, " m"]
    mean: Float[np.ndarray, " m"]
    precision: Float[np.ndarray, " m"]
    log_height: Float[np.ndarray, " m"]


class Atoms(NamedTuple):
    """Atoms of all effects.

    `owner`, `shape` and `curve` are indices of the effect, the point of its shape
    parameters and its curve: offset + slope · amplitude [N]. The weight is the log
    prior probability of an atom given its effect.
    """

    owner: Int[np.ndarray, " m"]
    shape: Int[np.ndarray, " m"]
    curve: Int[np.ndarray, " m"]
    amplitude: Amplitudes
    log_weight: Float[np.ndarray, " m"]
    offset: Float[np.ndarray, "c n"]
    slope: Float[np.ndarray, "c n"]

    def pick(self, index: Int[np.ndarray, " k"]) -> "Atoms":
        """Return some of the atoms, each with a separate curve."""
        curve = self.curve[index]
        return Atoms(
            self.owner[index],
            self.shape[index],
            np.arange(len(index)),
            Amplitudes(*(column[index] for column in self.amplitude)),
            self.log_weight[index],
            self.offset[curve],
            self.slope[curve],
        )

    def bounded(self, size: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
        """Return amplitudes moved to the nearest possible ones."""
        return np.clip(size, self.amplitude.low, self.amplitude.high)


class Space(NamedTuple):
    """Columns whose coefficients have one prior sd, on a grid `scale` of it.

    `shape` is the point of the shape parameters of an effect with several amplitudes,
    −1 of the other components; columns are in newtons per unit.
    """

    owner: int
    columns: Float[np.ndarray, "j n"]
    scale: Float[np.ndarray, " t"]
    log_weight: Float[np.ndarray, " t"]
    shape: int = -1


def principal(columns: Float[np.ndarray, "k n"], most: int = MOST_COLUMNS):
    """Return at most so many columns with nearly the same covariance, shape (j, n)."""
    if len(columns) <= most:
        return columns
    return np.linalg.eigh(columns @ columns.T)[1][:, -most:].T @ columns
