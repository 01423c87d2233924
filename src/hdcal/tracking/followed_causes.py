"""Which of the causes that a calibration averages over can be followed row by row."""

from collections.abc import Sequence

from hdcal.inference.mixed_posterior import mixed_posterior, models_of
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import misfits
from hdcal.prediction.engine.causes import Cause, averaging_words, causes_of, likeliest
from hdcal.report.words import hypothesis, percent
from hdcal.tracking.effect_tracking import force_effects, unfollowed
from hdcal.tracking.stream_prior import prior_from_posterior

# Of less of the probability nothing is said by following the rest.
_LEAST_FOLLOWED = 0.5


def followed_causes(known: Posterior, forget: float) -> tuple[Posterior, list[str]]:
    """Return the models that can be followed as one posterior, and what that is.

    Args:
        known: a calibration, or the mixture of a diagnosis.
        forget: share of the past kept at each reading.

    Returns:
        The posterior, and sentences, what no cause explains in its rows among them. It
        is the whole one, for its faults to be told, where most of the probability
        cannot be followed.
    """
    causes = causes_of(known)
    if len(causes) == 1:
        return known, averaging_words(causes) + _unexplained(causes)
    models = {
        cause.name: (cause.probability, alone)
        for cause, (_, alone) in zip(causes, models_of(known), strict=True)
        if _can_be_followed(alone, forget)
    }
    total = sum(share for share, _ in models.values())
    if total < _LEAST_FOLLOWED:
        return known, averaging_words(causes)
    kept = mixed_posterior({n: (p / total, m) for n, (p, m) in models.items()})
    told, lost = averaging_words(causes), {c.name for c in causes} - models.keys()
    if lost:
        left = ", ".join(map(hypothesis, sorted(lost)))
        told.append(
            f"{left} cannot be followed row by row: {percent(1.0 - total)} of the "
            "probability has no part in these answers."
        )
    return kept, told + _unexplained([c for c in causes if c.name in models])


def _unexplained(causes: Sequence[Cause]) -> list[str]:
    found = misfits(likeliest(causes).posterior)
    return [*found, "An alarm may come of that, without a change."] if found else []


def _can_be_followed(alone: Posterior, forget: float) -> bool:
    if not force_effects(alone):
        return True
    return forget == 1.0 and not unfollowed(alone, prior_from_posterior(alone))
