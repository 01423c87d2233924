"""The options of the two questions that `hdcal design` answers."""

from functools import partial

import click

from hdcal.cli.option_types import ENDS, FORCE, LENGTH, STRESS, read_ends, read_named
from hdcal.cli.options import (
    combined,
    is_given,
    material_option,
    repeated_option,
    without_meaning,
)
from hdcal.errors import Finding

# Parameters of one question only.
OF_WINDOW = ("window", "setting_sd", "rates")
OF_LIMIT = ("limit_force", "limit_stress", "deformation", "vary", "materials")

window_options = combined(
    click.option(
        "--window",
        type=ENDS,
        help="Deformation to keep [mm]: backlash beyond its end nearer to zero, "
        "jam beyond the other. Asks for a spring.",
    ),
    click.option(
        "--setting-sd",
        type=LENGTH,
        default=0.0,
        help="Scatter of the spring's set point as built.",
    ),
    click.option(
        "--spring-rate",
        "rates",
        type=ENDS,
        help="Spring rates to look at [N/mm] [default: those of springs that can "
        "stand inside the gear, to 100 times its stiffness].",
    ),
)


def _sizes() -> list[str]:
    from hdcal.prediction.engine.sizes import SIZES

    return list(SIZES)


limit_options = combined(
    click.option(
        "--limit-force",
        type=FORCE,
        help="Size of the force not to be exceeded. Asks for sizes.",
    ),
    click.option(
        "--limit-stress",
        type=STRESS,
        help="Hoop stress not to be exceeded [default: the yield strength].",
    ),
    click.option(
        "--deformation",
        type=LENGTH,
        help="At which the limit holds [default: nominal].",
    ),
    repeated_option(
        "--vary",
        metavar="SIZE_mm=LO:HI",
        read=partial(read_named, read=read_ends, known=_sizes),
        help="A size that may change: wall_thickness_mm=0.5:0.8; may be repeated.",
    ),
    material_option("Materials to choose among [default: the gear's]."),
)


def question_findings() -> list[Finding]:
    """Return what is wrong where not exactly one question is asked."""
    window, limit = is_given("window"), is_given("limit_force")
    if window == limit:
        words = "both ask at once" if window else "nothing is asked"
        remedy = "Say either --window LO:HI or --limit-force N"
        return [Finding("--window and --limit-force", words, remedy)]
    if window:
        return without_meaning(OF_LIMIT, "--window")
    return without_meaning(OF_WINDOW, "--limit-force")
