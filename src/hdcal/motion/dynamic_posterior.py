"""The calibrated posterior of a moving gear."""

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

from hdcal.data.prior import Prior
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.motion.dynamic_priors import dynamic_sites
from hdcal.motion.dynamic_problem import DynamicProblem, build_dynamic

# The setting with the probability of each model of the loss.
LOSS = "loss"


class DynamicPosterior(Posterior):
    """A dynamic calibration: draws in code units, priors, checks and provenance.

    It knows mass, damping, stiffness and dry friction, and nothing of the zero of the
    force or of other effects: forces are predicted from a calibration of the gear at
    rest.
    """

    kind: ClassVar[str] = "dynamic"

    @property
    def sites(self) -> dict[str, tuple[int, ...]]:
        """Shape of each parameter that a draw holds."""
        return dict.fromkeys(dynamic_sites(self.case, self.effects), ())

    @cached_property
    def effective_priors(self) -> Mapping[str, Prior]:
        """The priors; none depends on another parameter."""
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
        """Probability of each model of the loss; empty where they were not weighed."""
        return self.settings.get(LOSS, {})

    @cached_property
    def moving(self) -> DynamicProblem:
        """The inference problem that was sampled."""
        return build_dynamic(self.case, self.priors, self.theory, self.effects)
