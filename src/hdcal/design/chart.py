"""Designs as charts: springs by how surely they do, materials by their force."""

from collections.abc import Sequence

import numpy as np

from hdcal.design.inverse_design import InverseDesign
from hdcal.design.springs import Spring
from hdcal.design.wave_generator import WaveGenerator
from hdcal.report.chart import COLOURS, Chart, Series


def spring_rows(found: WaveGenerator) -> Sequence[Spring]:
    """Return every spring rate that was looked at."""
    return found.springs


def candidate_rows(found: InverseDesign) -> list[dict]:
    """Return the best design of each material."""
    return [
        {
            "material": each.basis.material,
            **each.sizes,
            "met": each.met,
            "force_N": each.force,
            "kept": each.kept,
            "change": each.change,
        }
        for each in found.candidates
    ]


def candidate_chart(found: InverseDesign) -> Chart:
    """Return the force of each material's design over how far it was changed."""
    change = np.array([each.change for each in found.candidates])
    force = np.array([each.force for each in found.candidates])
    tested = np.array([found.tested.change]), np.array([found.tested.force])
    return Chart(
        "distance from the tested gear",
        "force [N]",
        [
            Series("best of each material [N]", change, force, COLOURS[0], points=True),
            Series("the tested gear [N]", *tested, COLOURS[1], points=True),
        ],
    )


def generator_chart(found: WaveGenerator) -> Chart:
    """Return the probability of the window over the spring rate."""
    rates = np.array([spring.rate for spring in found.springs])
    sure = np.array([spring.together for spring in found.springs])
    every = Series("in the window at all temperatures", rates, sure, COLOURS[0])
    chosen = Series(
        "chosen",
        np.array([found.chosen.rate]),
        np.array([found.chosen.together]),
        COLOURS[1],
        points=True,
    )
    return Chart("spring rate [N/mm]", "probability", [every, chosen])
