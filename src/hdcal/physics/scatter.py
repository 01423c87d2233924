"""Scatter effects: members of one kind that differ, described by their spread."""

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar, Literal, final

import jax.numpy as jnp
from jax.scipy.special import ndtri
from jaxtyping import Float, Int

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows

Kind = Literal["run", "specimen"]
# Multiples of it fill the unit interval evenly, whatever their number.
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def scores(label: Int[Array, " n"]) -> Float[Array, " n"]:
    """Return a standard normal score for each label, the same one every time."""
    return ndtri(jnp.mod((jnp.asarray(label) + 1.0) * _GOLDEN, 1.0))


class Scatter(Effect):
    """An effect whose members, runs or specimens, deviate by sd · N(0, 1) each.

    Its one amplitude is the spread. What `apply` does, with fixed scores in place of
    the members' own, serves tests and illustrations. A calibration never calls it:
    its model has a zero for each run and a stiffness for each specimen, integrates
    them out where it can, and infers the spread under `run_offset_sd` and
    `specimen_sd`.

    Class attributes:
        members: what differs, run or specimen.
    """

    told: ClassVar[tuple[str, ...]] = (*Effect.told, "members", "sd")
    members: ClassVar[Kind]

    if TYPE_CHECKING:
        sd: Float[Array, ""] | float

    @abstractmethod
    def unit(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return what one unit of its member's deviation does to each row.

        Args:
            signal: of the effect's stage.
            rows: the covariates and earlier stages.
        """

    @final
    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the signal with every member at its own place."""
        label = getattr(rows.records, self.members)
        return signal + self.sd * scores(label) * self.unit(signal, rows)
