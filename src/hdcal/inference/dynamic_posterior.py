"""The calibrated posterior of a moving gear, kept in the same kind of file."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from hdcal.data.prior import Prior
from hdcal.errors import Finding, InputError
from hdcal.inference import posterior_file
from hdcal.inference.dynamic_priors import dynamic_sites
from hdcal.inference.dynamic_problem import DynamicProblem, build_dynamic
from hdcal.inference.held import LOSS
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem


class DynamicPosterior(Posterior):
    """A dynamic calibration: draws in code units, priors, checks and provenance.

    It knows mass, damping, stiffness and dry friction, and nothing of the zero of the
    force or of other effects: forces are predicted from a calibration of the gear at
    rest.
    """

    kind: ClassVar[str] = "dynamic"

    def sites(self, case, effects, with_gap) -> dict[str, tuple[int, ...]]:
        """Return the shape of each parameter that a draw holds."""
        return dict.fromkeys(dynamic_sites(case, effects), ())

    @cached_property
    def effective_priors(self) -> Mapping[str, Prior]:
        """The priors; none hangs on another parameter."""
        return self.priors

    @cached_property
    def problem(self) -> Problem:
        """Raise: there is no model of the force as read.

        Raises:
            InputError: always.
        """
        words = "this is a calibration of the moving gear, which knows no force zero"
        remedy = "Take one of the gear at rest, or ask how the gear responds"
        raise InputError([Finding(self.case.name, words, remedy)])

    @property
    def loss(self) -> Mapping[str, float]:
        """How probable each model of the loss is; empty where they were not weighed."""
        found: Any = self.settings.get(LOSS)
        return found or {}

    @cached_property
    def moving(self) -> DynamicProblem:
        """The inference problem that was sampled."""
        return build_dynamic(self.case, self.priors, self.theory, self.effects)


def load_any(path: Path | str) -> Posterior:
    """Read a calibration of the gear at rest, or of the moving gear.

    Raises:
        InputError: as `Posterior.load`.
    """
    described = posterior_file.told(path, "model")
    kind = DynamicPosterior if '"kind": "dynamic"' in described else Posterior
    return kind.load(path)
