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
    """Priors of the amplitudes of items, each of shape (m,).

    The density is exp(log_height − precision · (a − mean)² / 2) from low to high.

    Attributes:
        mean: centre of the normal.
        precision: of the normal; 0 where the density is flat.
        log_height: log density at the centre.
    """

    low: Float[np.ndarray, " m"]
    high: Float[np.ndarray, " m"]
    mean: Float[np.ndarray, " m"]
    precision: Float[np.ndarray, " m"]
    log_height: Float[np.ndarray, " m"]


class Atoms(NamedTuple):
    """Atoms of all effects.

    Attributes:
        owner: index of the effect, shape (m,).
        shape: index of the point of its shape parameters, shape (m,).
        curve: index of its curve, shape (m,).
        amplitude: priors of the amplitudes.
        log_weight: log prior probability of each atom of its effect, shape (m,).
        offset: contribution of each curve at amplitude 0 [N], shape (c, n).
        slope: contribution per unit of the amplitude [N], shape (c, n).
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
    """Columns whose coefficients have one prior sd, on a grid of it.

    Attributes:
        owner: index of the component.
        columns: contribution per unit of each coefficient [N], shape (j, n).
        scale: values of the prior sd, shape (t,).
        log_weight: log prior probability of each, shape (t,).
        shape: index of the point of the shape parameters of an effect with several
            amplitudes; −1 of the others.
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
