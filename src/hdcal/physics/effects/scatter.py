"""Runs and specimens that differ, described by their spread."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jax.scipy.special import ndtri
from jaxtyping import Int

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, PerRow, Rows, parameter
from hdcal.physics.theory import Scalar

Kind = Literal["run", "specimen"]
# The fractional parts of its multiples fill the unit interval evenly.
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def scores(label: Int[Array, " n"]) -> PerRow:
    """Return a fixed standard normal score for each label."""
    return ndtri(jnp.mod((jnp.asarray(label) + 1.0) * _GOLDEN, 1.0))


class Scatter(Effect):
    """An effect by which members, runs or specimens, deviate by sd · N(0, 1) each.

    Its amplitude is the spread. `apply` uses fixed scores. A calibration does not call
    it: its model has a zero for each run and a stiffness for each specimen, integrates
    them out where it can, and infers `run_offset_sd` and `specimen_sd`.
    """

    members: ClassVar[Kind]


class RunOffset(Scatter, stage="sensor", family="mounting or gear", needs=("runs",)):
    """F → F + b_i in run i, with b_i ~ N(0, sd²).

    The zero differs from mounting to mounting.

    Source: Gelman et al., Bayesian Data Analysis (varying-intercept model).
    """

    members = "run"
    sd: Scalar = parameter(
        "N", "spread of the zeros of the runs", typical=2.0, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal + self.sd * scores(rows.records.run)


class SpecimenVariation(
    Scatter, stage="force", family="mounting or gear", needs=("specimens",)
):
    """F → F (1 + d_i) of specimen i, with d_i ~ N(0, sd²).

    The stiffness differs from gear to gear of a batch.

    Source: Gelman et al., Bayesian Data Analysis (varying-slope model).
    """

    members = "specimen"
    sd: Scalar = parameter(
        "1", "relative spread of the specimens' stiffnesses", typical=0.05, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal + self.sd * scores(rows.records.specimen) * signal
