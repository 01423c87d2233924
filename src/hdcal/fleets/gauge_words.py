"""Gauge R&R in words."""

import numpy as np

from hdcal.fleets.gauge import GaugeAnswer
from hdcal.report.document import Facts, Section, Text
from hdcal.report.words import estimate, known


def gauge_section(found: GaugeAnswer) -> Section:
    """Return how well one reading tells gears apart, as quality people read it."""
    rows = [
        ("repeatability: readings", found.repeatability_N, "{N}"),
        ("reproducibility: mountings, operators, rigs", found.reproducibility_N, "{N}"),
        ("gears and lots", found.gears_N, "{N}"),
        (
            "gauge, of all that scatters (study variation)",
            found.percent_study_variation,
            "%",
        ),
        ("gauge, of the tolerance", found.percent_tolerance, "%"),
    ]
    told = [
        (what, f"{estimate(one)[0]} {unit} ({estimate(one)[1]})".replace("  ", " "))
        for what, one, unit in rows
        if one is not None
    ]
    many = [f"{end:.0f}" for end in vars(found.distinct_categories).values()]
    told.append(("distinct categories", "{} ({} … {})".format(*many)))
    words = (
        f"Of one reading of the {{load}} at {found.deformation_mm:g} {{mm}}, by "
        "standard "
        "deviations. Below 10 % of study variation or tolerance a gauge is usually "
        "called good, above 30 % it is not, and it should tell five categories or "
        "more. The stiffness above rests on all readings of a gear and is told far "
        "better than by one."
    )
    asked = found.percent_tolerance is not None
    blocks = [Text(_verdict(found)), Facts(told), Text(words, soft=True)]
    return Section("Gauge R&R", blocks, brief=asked)


def _verdict(found: GaugeAnswer) -> str:
    """Return whether the gauge is good enough, by the customary bounds."""
    against, whose = found.percent_study_variation, "of all that scatters"
    if found.percent_tolerance is not None:
        against, whose = found.percent_tolerance, "of the tolerance"
    ends = [known(end) and end for end in vars(against).values()]
    middle, span = estimate(against)
    said = f"The gauge takes {middle} % {whose} (95 %: {span} %)"
    for low, high, words in (
        (-np.inf, 10.0, "which is usually called good"),
        (10.0, 30.0, "which is usually called acceptable"),
        (30.0, np.inf, "which is usually called not good enough"),
    ):
        if all(low <= end < high for end in ends):
            return f"{said}, {words}."
    return f"{said}: whether it is good enough these data do not settle."
