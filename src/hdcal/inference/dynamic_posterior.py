"""The calibrated posterior of a moving gear, kept in the same kind of file."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import jax
import numpy as np
import xarray as xr
from arviz_base import from_dict

from hdcal.data.case import Case
from hdcal.errors import Finding, InputError
from hdcal.inference import archive
from hdcal.inference.dynamic_problem import DynamicProblem, build_dynamic, pointwise
from hdcal.inference.posterior import Posterior, sampler_statistics
from hdcal.inference.problem import Problem
from hdcal.inference.sample import Draws


class DynamicPosterior(Posterior):
    """A dynamic calibration: draws in code units, priors, checks and provenance.

    It knows mass, damping and stiffness, and nothing of the zero of the force or of
    effects: forces are predicted from a calibration of the gear at rest.
    """

    kind: ClassVar[str] = "dynamic"

    @cached_property
    def problem(self) -> Problem:
        """Raise: there is no model of the force as read.

        Raises:
            InputError: always.
        """
        words = "this is a calibration of the moving gear, which knows no force zero"
        remedy = "Take one without --dynamic, or ask hdcal respond"
        raise InputError([Finding(self.case.name, words, remedy)])

    @cached_property
    def moving(self) -> DynamicProblem:
        """The inference problem that was sampled."""
        return build_dynamic(self.case, self.priors, self.theory)


@jax.jit
def _pointwise(problem: DynamicProblem, values):
    inner = jax.vmap(lambda one: pointwise(problem, one))
    return jax.vmap(inner)(values)


def build_dynamic_tree(
    case: Case,
    problem: DynamicProblem,
    draws: Draws,
    prior_draws: Mapping[str, np.ndarray],
) -> xr.DataTree:
    """Collect everything in ArviZ' groups; both columns count as observed.

    Args:
        case: data and gear.
        problem: what was sampled.
        draws: from the sampler.
        prior_draws: by parameter, each (draw,).
    """
    observed = ("force", "deformation")
    rows = {name: np.asarray(getattr(case.records, name)) for name in observed}
    return from_dict(
        {
            "posterior": draws.values,
            "prior": {name: values[None] for name, values in prior_draws.items()},
            "sample_stats": sampler_statistics(draws),
            "observed_data": rows,
            "constant_data": archive.covariates(case.records),
            "log_likelihood": {
                "deformation": np.asarray(_pointwise(problem, draws.values))
            },
        },
        dims={name: ["row"] for name in (*observed, *archive.UNITS)},
    )


def load_any(path: Path | str) -> Posterior:
    """Read a calibration of the gear at rest, or of the moving gear.

    Raises:
        InputError: as `Posterior.load`.
    """
    file = Path(path)
    file = file / "posterior.nc" if file.is_dir() else file
    described = str(archive.open_tree(file).attrs.get("model", ""))
    kind = DynamicPosterior if '"kind": "dynamic"' in described else Posterior
    return kind.load(path)
