"""Which of the causes that a calibration averages over can be followed row by row."""

from collections.abc import Sequence

from hdcal.data.case import require_force
from hdcal.inference.residuals import misfits
from hdcal.prediction.engine.causes import Cause, averaging_words, causes_of, likeliest
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import Pooled, pool_causes
from hdcal.report.words import hypothesis, percent
from hdcal.tracking.effect_tracking import force_effects, unfollowed
from hdcal.tracking.stream_prior import prior_from_posterior

# Of less of the probability nothing is said by following the rest.
_LEAST_FOLLOWED = 0.5


def followed_causes(models: Models, forget: float) -> tuple[Pooled, list[str]]:
    """Return the draws of the causes that can be followed, and what these are.

    Args:
        models: as `causes_of`.
        forget: share of the past kept at each reading.

    Returns:
        The draws, and sentences, what no cause explains in its rows among them. They
        are of all causes, for their faults to be reported, where most of the
        probability cannot be followed.
    """
    causes = causes_of(models)
    require_force(causes[0].posterior.case, "track")
    if len(causes) == 1:
        return pool_causes(causes), averaging_words(causes) + _unexplained(causes)
    kept = [cause for cause in causes if _can_be_followed(cause, forget)]
    total, told = sum(cause.probability for cause in kept), averaging_words(causes)
    if total < _LEAST_FOLLOWED:
        return pool_causes(causes), told
    if lost := {c.name for c in causes} - {c.name for c in kept}:
        left = ", ".join(map(hypothesis, sorted(lost)))
        told.append(
            f"{left} cannot be followed row by row: {percent(1.0 - total)} of the "
            "probability has no part in these answers."
        )
    return pool_causes(kept), told + _unexplained(kept)


def _unexplained(causes: Sequence[Cause]) -> list[str]:
    found = misfits(likeliest(causes).posterior)
    return [*found, "An alarm may come of that, without a change."] if found else []


def _can_be_followed(cause: Cause, forget: float) -> bool:
    alone = pool_causes([cause])
    if not force_effects(alone):
        return True
    return forget == 1.0 and not unfollowed(alone, prior_from_posterior(alone))
