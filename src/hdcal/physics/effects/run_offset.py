"""Every mounting has a zero of its own."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Rows, Stage, parameter
from hdcal.physics.scatter import Kind, Scatter


class RunOffset(Scatter):
    """F → F + b_i in run i, with b_i ~ N(0, sd²).

    Source: Gelman et al., Bayesian Data Analysis (varying-intercept model).
    """

    name: ClassVar[str] = "run_offset"
    stage: ClassVar[Stage] = "sensor"
    groups: ClassVar[tuple[str, ...]] = ("mounting or gear",)
    needs: ClassVar[frozenset[str]] = frozenset({"runs"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"
    members: ClassVar[Kind] = "run"

    sd: Float[Array, ""] | float = parameter(
        "N", "spread of the zeros of the runs", typical=2.0, null=0.0
    )

    def unit(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return one newton at every row."""
        return jnp.ones_like(signal)
