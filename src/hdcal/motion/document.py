"""A dynamic calibration in words: the only place of its sentences."""

from hdcal.inference.dynamic_posterior import DynamicPosterior
from hdcal.motion.answer import DynamicCalibrationAnswer
from hdcal.motion.quantities import QUANTITIES, quantity_table
from hdcal.report.document import Document, Picture, Section, Sentences, notices
from hdcal.report.parameters import Interval
from hdcal.report.posterior_sections import (
    check_section,
    parameter_section,
    prior_section,
)
from hdcal.report.provenance import provenance_rows
from hdcal.report.words import estimate

ASSUMPTIONS = (
    "The force is the input: taken as read, without error, and linear between the "
    "rows.",
    "The deformation is the output: read with a zero of its own and white noise.",
    "Mass, damping and stiffness are constant and per millimetre as read.",
)


def headline(found: Interval) -> str:
    """Return the natural frequency [Hz] in one sentence."""
    middle, span = estimate(found)
    return f"The gear swings freely at {middle} Hz, 95 % credible interval {span} Hz."


def next_steps(posterior: DynamicPosterior) -> list[str]:
    """Return what to do next, most urgent first."""
    if posterior.usable:
        return []
    return [
        "Do not use this result. Calibrate with more warm-up and draws; if it still "
        "fails, look at the data."
    ]


def motion_document(
    posterior: DynamicPosterior, found: DynamicCalibrationAnswer, command: str = ""
) -> Document:
    """Return the report; its pictures are motion, priors and sampler."""
    return Document(
        name=posterior.case.gear.name,
        kind="dynamic calibration",
        subtitle=f"Calibration of the moving gear from {found.data.rows} readings over "
        f"time ({found.data.name}): mass, damping and stiffness of m ÿ + c ẏ + k y = "
        f"F(t), theory “{found.gear.theory}”.",
        # Of a failed calibration the page shows it struck through.
        headline=headline(found.natural_frequency_Hz),
        next_steps=next_steps(posterior),
        notices=[
            *notices(("Remarks", found.flat_directions), tone="neutral"),
            *notices(("To be aware of", found.warnings)),
        ],
        sections=[
            _quantities(found),
            _record(found),
            parameter_section(found.parameters, brief=False),
            check_section(found.checks),
            prior_section(posterior),
        ],
        provenance=provenance_rows(posterior, command),
        failed=found.reasons,
        failed_words="The calibration did not pass its checks, so every number and "
        "band on this page may be wrong.",
    )


def _quantities(found: DynamicCalibrationAnswer) -> Section:
    shown = {n: getattr(found, n) for n in QUANTITIES if hasattr(found, n)}
    shown["mass_kg"] = found.parameters["mass"]
    return Section("How the gear swings", [quantity_table(shown)], brief=True)


def _record(found: DynamicCalibrationAnswer) -> Section:
    picture = Picture(
        "motion",
        "Measured deformation over time with the bands of the calibrated model",
        "Dark band: where the model lies with 95 % probability. Light band: where one "
        "new reading lies with 95 % probability. The numbers are in motion.csv.",
        tall=True,
    )
    return Section("Record and model", [picture, Sentences(found.assumptions)])
