"""A dynamic calibration in words: the only place of its sentences."""

from hdcal.motion.answer import DynamicCalibrationAnswer, Loss
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.quantities import QUANTITIES, quantity_table
from hdcal.report.document import (
    Document,
    Picture,
    Section,
    Sentences,
    Text,
    notices,
)
from hdcal.report.intervals import Interval
from hdcal.report.posterior_sections import (
    check_section,
    parameter_section,
    prior_section,
)
from hdcal.report.provenance import provenance_rows
from hdcal.report.words import estimate, percent, percent_span

_ALWAYS = (
    "The force is the input: taken as read, without error, and linear between the "
    "rows.",
    "The deformation is the output: read with a zero of its own and white noise.",
)
_ONE_TEMPERATURE = (
    "Mass, damping and stiffness are constant and per millimetre as read."
)
_WARMING = (
    "Mass and damping are constant, the stiffness follows the temperature of each row; "
    "all are per millimetre as read."
)
_FRICTION = (
    "Dry friction is one force against the motion, and holds the gear where it rests."
)


def assumptions(posterior: DynamicPosterior) -> tuple[str, ...]:
    """Return what the model takes for granted."""
    constant = posterior.moving.change is None
    found = (*_ALWAYS, _ONE_TEMPERATURE if constant else _WARMING)
    return (*found, _FRICTION) if posterior.effects else found


def headline(found: Interval, loss: Loss) -> str:
    """Return the natural frequency [Hz], and the loss if it is not viscous."""
    middle, span = estimate(found)
    words = f"The gear swings freely at {middle} Hz, 95 % credible interval {span} Hz"
    if loss.name == "dry friction":
        return f"{words}, and dry friction stops it."
    if loss.name == "both":
        return f"{words}, and both damping and dry friction stop it."
    return f"{words}."


def loss_words(loss: Loss) -> str:
    """Return what takes the energy of a swing in one sentence, empty if unasked."""
    share = ""
    if loss.dry_share is not None and loss.name != "dry friction":
        part = percent_span(loss.dry_share)
        share = f"; dry friction takes {part} of what the largest swing loses"
    sure = percent(max(loss.probabilities.values(), default=None))
    if loss.name == "viscous" and not loss.probabilities:
        return (
            "Its swings die out by viscous damping: what that leaves is noise, and dry "
            "friction would show."
        )
    if loss.name == "viscous":
        others = " and ".join(name for name in loss.probabilities if name != loss.name)
        return (
            f"Its swings die out by viscous damping (probability {sure}, beside "
            f"{others}){share}."
        )
    if loss.name == "dry friction":
        return f"Its swings die out by dry friction alone (probability {sure})."
    if loss.name == "both":
        return (
            "Its swings die out by viscous damping and dry friction (probability "
            f"{sure}){share}."
        )
    if loss.name == "cannot tell":
        each = ", ".join(f"{n} {percent(p)}" for n, p in loss.probabilities.items())
        return f"What its swings die out by cannot be told ({each}){share}."
    if loss.probabilities:
        each = ", ".join(loss.probabilities)
        return (
            "What its swings die out by has no name here: the likeliest of "
            f"{each} leaves more than noise."
        )
    return f"Dry friction was asked for{share}." if share else ""


def next_steps(posterior: DynamicPosterior, loss: Loss) -> list[str]:
    """Return what to do next, most urgent first."""
    if not posterior.usable:
        return [
            "Do not use this result. Calibrate with more warm-up and draws; if it "
            "still fails, look at the data."
        ]
    if loss.name in ("dry friction", "both") and not posterior.effects:
        return [
            "Calibrate with the effect coulomb_friction, which may take an hour: "
            "without it all friction counts as damping, and the intervals are too "
            "narrow."
        ]
    if loss.name == "cannot tell":
        return [
            "To tell viscous damping from dry friction, release the gear from a larger "
            "deformation and record until it rests."
        ]
    return []


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
        headline=headline(found.natural_frequency_Hz, found.loss),
        next_steps=next_steps(posterior, found.loss),
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
    words = [Text(loss_words(found.loss))] if loss_words(found.loss) else []
    table = quantity_table(shown)
    return Section("How the gear swings", [*words, table], brief=True)


def _record(found: DynamicCalibrationAnswer) -> Section:
    picture = Picture(
        "motion",
        "Measured deformation over time with the bands of the calibrated model",
        "Inner band: where the model lies with 95 % probability. Outer band: where one "
        "new reading lies with 95 % probability. The numbers are in motion.csv.",
        tall=True,
    )
    return Section("Record and model", [picture, Sentences(found.assumptions)])
