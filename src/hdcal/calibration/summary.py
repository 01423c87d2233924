"""A calibration as an answer, and all that its result folder holds."""

from functools import cache

from hdcal.calibration.answer import CalibrationAnswer, ResidualShape
from hdcal.calibration.document import (
    ARTICLE_NOTE,
    calibration_document,
    headline,
    next_steps,
)
from hdcal.data.theory_names import SPRING
from hdcal.inference.posterior import FILE_NAME, Posterior
from hdcal.inference.residuals import Residuals, residuals
from hdcal.physics.theory import THEORIES
from hdcal.prediction.bands.bands import Bands, default_bands
from hdcal.report.parameters import Interval, credible_interval
from hdcal.report.plain import as_plain
from hdcal.report.posterior_answer import posterior_entries
from hdcal.report.write import Report


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
    steps = tuple(next_steps(posterior, left))
    stiffness = credible_interval(posterior.draws["stiffness"])
    entries = posterior_entries(posterior, headline(stiffness), steps)
    found = *left.structure, *left.noise
    entries["warnings"] += tuple(shape.words for shape in found)
    return CalibrationAnswer(
        **entries,
        K_by_theory=K_by_theory(posterior),
        K_note=ARTICLE_NOTE,
        residuals=tuple(
            ResidualShape(each.name, each.p_value, each.size_N, each.words)
            for each in found
        ),
        next_steps=steps,
        effects=tuple(effect.name for effect in posterior.effects),
        with_gap=bool(posterior.settings["with_gap"]),
    )


def calibration_report(
    posterior: Posterior, command: str = ""
) -> Report[CalibrationAnswer]:
    """Return all that `hdcal calibrate` leaves behind."""
    left = residuals(posterior)
    found = calibration_answer(posterior, left)

    @cache
    def bands() -> Bands:
        return default_bands(posterior)

    def figures():
        from hdcal.calibration.figure.bands import calibration_figure
        from hdcal.calibration.figure.residuals import residual_figure
        from hdcal.report.draws_figure import prior_figure, sampler_figure

        return {
            "calibration": calibration_figure(posterior, bands(), left),
            "residuals": residual_figure(posterior, left),
            "priors": prior_figure(posterior),
            "sampler": sampler_figure(posterior),
        }

    return Report(
        calibration_document(posterior, found, command),
        found,
        "summary.json",
        figures,
        kept=["calibration"],
        tables=lambda: {"bands.csv": bands().columns()},
        others=lambda: [(FILE_NAME, posterior.to_netcdf())],
    )


def K_by_theory(posterior: Posterior) -> dict[str, Interval | None]:
    """Return K under every theory from the one posterior: K_a k_a = K_b k_b.

    None where there are no sizes: the stiffness of a spring is no factor of a theory.
    """
    geometry = posterior.case.gear.geometry
    sized = {name: theory for name, theory in THEORIES.items() if name != SPRING}
    if posterior.theory == SPRING:
        return dict.fromkeys(sized)
    own = float(THEORIES[posterior.theory](geometry, 1.0))
    return {
        name: credible_interval(
            posterior.draws["K"] * (own / float(theory(geometry, 1.0)))
        )
        for name, theory in sized.items()
    }
