"""A calibration as an answer, and all that its result folder holds."""

from collections.abc import Iterator
from functools import cache

import numpy as np

from hdcal.calibration.answer import (
    CalibrationAnswer,
    LocalStiffness,
    ResidualShape,
)
from hdcal.calibration.document import (
    ARTICLE_NOTE,
    LOOPED,
    calibration_document,
    headline,
    next_steps,
)
from hdcal.calibration.loop_stiffness import loop_stiffness
from hdcal.data.case import Case
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_file import FILE_NAME
from hdcal.inference.residuals import Residuals, residuals
from hdcal.physics.theory import THEORIES
from hdcal.prediction.bands.bands import Bands, default_bands
from hdcal.report.parameters import INTERVAL, Interval, credible_interval
from hdcal.report.plain import as_plain
from hdcal.report.posterior_answer import posterior_entries
from hdcal.report.write import Report

# Where the slope of a bend is told: shares of the readings below.
NEAR_ENDS = (0.1, 0.9)
# Slopes that differ by less of their size are those of a loop or a wave, of no bend.
_SAME_SLOPE = 0.1


def summarise(posterior: Posterior, left: Residuals | None = None) -> dict:
    """Return a calibration as plain data: the content of summary.json.

    Args:
        posterior: from `calibrate`.
        left: its residuals, if they are at hand.

    Raises:
        InputError: it is another result.
    """
    if not isinstance(posterior, Posterior):
        words = f"a {type(posterior).__name__} is no calibration"
        remedy = "Its numbers are in .to_frame() and .to_datatree()"
        raise InputError([Finding("posterior", words, remedy)])
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
    bend = tuple(_bend(posterior, left))
    found = *left.structure, *left.noise
    looped = LOOPED in {shape.name for shape in found}
    plain = not posterior.effects and not posterior.settings["with_gap"]
    beside = _beside_a_loop(posterior.case) if looped and plain and not bend else None
    loop = {"looped": looped, "beside_a_loop": beside}
    first = headline(stiffness, posterior, bend, **loop)
    entries = posterior_entries(posterior, first, steps)
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
        bend=bend,
        beside_a_loop=beside,
        specimens=dict(_specimens(posterior)),
    )


def _specimens(posterior: Posterior) -> Iterator[tuple[str, Interval]]:
    """Yield each of several specimens with its stiffness."""
    own = posterior.draws.get("specimen_deviation")
    if own is not None:
        each = posterior.draws["stiffness"][:, None] * (1.0 + own)
        yield from zip(
            posterior.case.specimen_labels,
            map(credible_interval, each.T),
            strict=True,
        )


def _beside_a_loop(case: Case) -> Interval | None:
    tail = (1.0 - INTERVAL) / 2.0
    found = loop_stiffness(case, np.array([0.5, tail, 1.0 - tail]))
    return None if found is None else Interval(*map(float, found))


def _bend(posterior: Posterior, left: Residuals) -> Iterator[LocalStiffness]:
    """Yield the slope near both ends of a curve that a straight line does not fit."""
    seen = any(shape.name == "curvature" for shape in left.structure)
    if not seen or posterior.effects or posterior.settings["with_gap"]:
        return
    slope = np.polyder(np.polyfit(left.deformation, left.measured, 2))
    places = np.quantile(left.deformation, NEAR_ENDS)
    low, high = np.polyval(slope, places)
    if abs(high - low) > _SAME_SLOPE * max(abs(low), abs(high)):
        yield LocalStiffness(float(places[0]), float(low))
        yield LocalStiffness(float(places[1]), float(high))


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

    def charts():
        from hdcal.calibration.chart import calibration_charts

        # Of a failed calibration there is the marked figure alone.
        if not posterior.usable:
            return {}
        return {"calibration": calibration_charts(bands(), left)}

    return Report(
        calibration_document(posterior, found, command),
        found,
        "summary.json",
        figures,
        kept=["calibration"],
        tables=lambda: {"bands.csv": bands().columns()},
        others=lambda: [(FILE_NAME, posterior.to_netcdf())],
        charts=charts,
        theory=posterior.theory,
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
