"""What an answer may be asked of: a calibrated model, or several with their weights."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior


class Averaged(Protocol):
    """Calibrated models with their probabilities, as a diagnosis holds them."""

    @property
    def posteriors(self) -> Mapping[str, tuple[float, Posterior]]:
        """Models by hypothesis, each with its probability."""
        ...


Models = Posterior | Averaged | Sequence[tuple[float, Posterior]]


def model_pairs(models: Models) -> Sequence[tuple[float, Posterior]]:
    """Return models with their weights.

    Raises:
        InputError: it is no calibrated model, or a diagnosis without any.
    """
    if isinstance(models, Posterior):
        return [(1.0, models)]
    held = getattr(models, "posteriors", None)
    if held is None and isinstance(models, Sequence):
        return models
    if not held:
        quick = " and a quick diagnosis holds none" * (held is not None)
        words = f"{type(models).__name__} is no calibrated model{quick}"
        remedy = "Give what calibrate or diagnose returned, itself"
        remedy += "; diagnose without quick" * bool(quick)
        # A fleet, or its posterior.
        own = hasattr(models, "next_force")
        remedy = "Ask its own next_force" if own else remedy
        raise InputError([Finding("models", words, remedy)])
    return list(held.values())
