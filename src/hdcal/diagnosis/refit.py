"""The corrected model by NUTS: of the name, or of each member of the set."""

from collections.abc import Mapping
from dataclasses import replace

from hdcal.calibration.calibrate import calibrate
from hdcal.data.case import Case
from hdcal.diagnosis.model_posterior import ModelPosterior
from hdcal.diagnosis.verdict import Which
from hdcal.diagnosis.where import interval
from hdcal.evidence.case_evidence import NONE, UNKNOWN
from hdcal.inference.posterior import Posterior
from hdcal.inference.sample import Progress
from hdcal.physics.effect import Effect

# Members of the set that are calibrated for the bands, and their least probability.
_MOST_REFITS, _LEAST_SHARE = 3, 0.05

# Probability and posterior by hypothesis.
Refits = Mapping[str, tuple[float, Posterior]]


def refit(
    case: Case,
    which: Which,
    posterior: ModelPosterior,
    library: dict[str, type[Effect]],
    seed: int,
    progress: Progress | None,
) -> Refits:
    """Calibrate the corrected model by NUTS: the name, or each member of the set.

    Returns:
        Probability and posterior by hypothesis; `none` for the plain model and
        `unknown` for the plain model with a leftover gap.
    """
    if which.verdict in ("none", "unknown"):
        chosen = {which.verdict: 1.0}
    elif which.verdict == "named" and which.effect:
        chosen = {"+".join(sorted(which.named)): 1.0}
    else:
        share = sorted(posterior.probabilities.items(), key=lambda item: -item[1])
        kept = [item for item in share if item[1] >= _LEAST_SHARE][:_MOST_REFITS]
        total = sum(probability for _, probability in kept)
        chosen = {name: probability / total for name, probability in kept}
    result = {}
    for name, share in chosen.items():
        effects = () if name in (NONE, UNKNOWN) else tuple(name.split("+"))
        calibrated = calibrate(
            case,
            effects=effects,
            with_gap=name == UNKNOWN,
            seed=seed,
            registry=library,
            progress=progress,
        )
        result[name] = (share, calibrated)
    return result


def with_sampled_size(which: Which, fits: Refits) -> Which:
    """Return the verdict with the named effect's size from its calibration.

    There the zero of the deformation is inferred too, about which the closed form
    only expands.
    """
    size = which.amplitude
    likeliest = max(fits, key=lambda name: fits[name][0], default=None)
    if size is None or likeliest is None or size.effect not in likeliest.split("+"):
        return which
    _, posterior = fits[likeliest]
    draws = posterior.draws.get(f"{size.effect}.{size.parameter}")
    if draws is None or not posterior.usable:
        return which
    return replace(which, amplitude=replace(size, **vars(interval(draws))))


def failure_reasons(fits: Refits) -> tuple[str, ...]:
    """Say why nothing may be used: every calibration failed."""
    if any(fit.usable for _, fit in fits.values()):
        return ()
    return tuple(
        f"the calibration with {name} failed its checks: " + "; ".join(fit.reasons)
        for name, (_, fit) in fits.items()
    )
