"""The calibrated posterior of a gear in motion."""

from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

from hdcal.data.prior import Prior
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem
from hdcal.motion.dynamic_problem import DynamicProblem, build_dynamic


class DynamicPosterior(Posterior):
    """A dynamic calibration: draws in code units, priors, checks and provenance.

    It has no offset of the force and no effect but dry friction: forces are predicted
    from a calibration at rest.
    """

    kind: ClassVar[str] = "dynamic"

    @property
    def sites(self) -> dict[str, tuple[int, ...]]:
        """Shape of each parameter of a draw."""
        return dict.fromkeys(self.priors, ())

    @cached_property
    def effective_priors(self) -> Mapping[str, Prior]:
        """The priors; none depends on another parameter."""
        return self.priors

    @cached_property
    def problem(self) -> Problem:
        """Raise `InputError`, as there is no model of the force as read."""
        words = "this is a calibration of the moving gear, without a force offset"
        remedy = "Take one of the gear at rest, or ask how the gear responds"
        raise InputError([Finding(self.case.name, words, remedy)])

    @cached_property
    def moving(self) -> DynamicProblem:
        """The inference problem that was sampled."""
        return build_dynamic(self.case, self.priors, self.theory, self.effects)
