"""A calibration as an answer: the numbers and words of summary.json."""

from hdcal.calibration.answer import CalibrationAnswer, ResidualShape
from hdcal.calibration.document import ARTICLE_NOTE, headline, next_steps
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import Residuals, residuals
from hdcal.physics.theory import THEORIES
from hdcal.report.parameters import Interval, credible_interval
from hdcal.report.plain import as_plain
from hdcal.report.posterior_answer import posterior_entries


def summarise(posterior: Posterior, left: Residuals | None = None) -> dict:
    """Return a calibration as plain data: the content of summary.json.

    Args:
        posterior: from `calibrate`.
        left: its residuals, if they are at hand.
    """
    return as_plain(calibration_answer(posterior, left))


def calibration_answer(
    posterior: Posterior, left: Residuals | None = None
) -> CalibrationAnswer:
    """Return a calibration as an answer, ready for JSON.

    Args:
        posterior: from `calibrate`.
        left: its residuals, if they are at hand.
    """
    left = left or residuals(posterior)
    entries = posterior_entries(posterior)
    entries["warnings"] += tuple(shape.words for shape in left.structure)
    steps = tuple(next_steps(posterior, left))
    return CalibrationAnswer(
        **entries,
        headline=headline(entries["stiffness_N_per_mm"], posterior.reasons),
        next_step=steps[0] if steps else None,
        K_by_theory=K_by_theory(posterior),
        K_note=ARTICLE_NOTE,
        residuals=tuple(ResidualShape(**vars(shape)) for shape in left.structure),
        next_steps=steps,
        effects=tuple(effect.name for effect in posterior.effects),
        with_gap=bool(posterior.settings["with_gap"]),
    )


def K_by_theory(posterior: Posterior) -> dict[str, Interval]:
    """Return K under every theory from the one posterior: K_a k_a = K_b k_b."""
    geometry = posterior.case.gear.geometry
    own = float(THEORIES[posterior.theory](geometry, 1.0))
    return {
        name: credible_interval(
            posterior.draws["K"] * (own / float(theory(geometry, 1.0)))
        )
        for name, theory in THEORIES.items()
    }
