"""The article's Tables 3 and 4, each row beside values that hold together.

Source: "Study on Flexible Gear Deformation in Harmonic Drive Gear".
"""

from dataclasses import dataclass, replace

import numpy as np

from hdcal.classical.audit.article import (
    DEFORMATION,
    INFLUENCE,
    MODULUS,
    TABLE_3,
    TABLE_4,
    article_gear,
)
from hdcal.data.records import Geometry
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.design.study.study import force_quantiles
from hdcal.errors import Finding, InputError
from hdcal.physics.theory import article, ring
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.sizes import stiffness_ratio

SCHEMA = "hdcal.article/1"


@dataclass(frozen=True)
class ArticleRow:
    """One row of the article, and what belongs in its place.

    Attributes:
        table: 3 or 4.
        deformation_mm: ω.
        wall_thickness_mm: δ.
        radius_mm: R.
        original_N: the article's "theoretical" force.
        revised_N: the same times its K = 0.13.
        measured_N: its own reading, where it has one.
        article_N: its plotted slope 1625.19 N/mm, scaled by δ³/R³ as its formula says.
        article_revised_N: that times 0.13.
        ring_N: the ring's force, the series dividing and the length counted; K = 1.
        calibrated_N: median, lo and hi with the K of a calibration, or None.
    """

    table: int
    deformation_mm: float
    wall_thickness_mm: float
    radius_mm: float
    original_N: float
    revised_N: float
    measured_N: float | None
    article_N: float
    article_revised_N: float
    ring_N: float
    calibrated_N: dict[str, float] | None


def article_rows(models: Models | None = None) -> tuple[ArticleRow, ...]:
    """Return Tables 3 and 4 of the article beside consistent values.

    Args:
        models: a calibration of the article's gear, for the calibrated forces.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: it is of another gear.
    """
    draws = None if models is None else design_draws(models)
    if draws is not None:
        _check_gear(draws)
    gear = article_gear()
    own = float(gear.wall_thickness), float(gear.radius)
    rows = [(3, at, *own, *forces) for at, *forces in TABLE_3]
    rows += [
        (4, DEFORMATION, wall, radius, *forces, None)
        for (wall, radius), forces in TABLE_4.items()
    ]
    return tuple(_row(draws, *row) for row in rows)


def _row(
    draws: DesignDraws | None, table, at, wall, radius, original, revised, measured
) -> ArticleRow:
    geometry = replace(article_gear(), wall_thickness=wall, radius=radius)
    plotted = float(article(geometry, MODULUS)) * at
    return ArticleRow(
        table=table,
        deformation_mm=at,
        wall_thickness_mm=wall,
        radius_mm=radius,
        original_N=original,
        revised_N=revised,
        measured_N=measured,
        article_N=plotted,
        article_revised_N=INFLUENCE * plotted,
        ring_N=float(ring(geometry, MODULUS)) * at,
        calibrated_N=None if draws is None else _calibrated(draws, wall, radius, at),
    )


def _calibrated(draws: DesignDraws, wall, radius, at) -> dict[str, float]:
    own = draws.gear.geometry
    geometry = Geometry(wall, radius, own.length, own.load_height, own.poisson)
    factor = np.array([float(stiffness_ratio(geometry, own, draws.theory))])
    warm = np.array([draws.gear.reference_temperature])
    shares = np.array([0.5, 0.025, 0.975])
    found = force_quantiles(draws, factor, np.array([at]), warm, shares)[:, 0]
    return dict(zip(("median", "lo", "hi"), map(float, found), strict=True))


def _check_gear(draws: DesignDraws) -> None:
    sizes = ("wall_thickness", "radius", "length")
    theirs = [float(getattr(article_gear(), name)) for name in sizes]
    ours = [float(getattr(draws.gear.geometry, name)) for name in sizes]
    if not np.allclose(ours, theirs):
        words = "is a calibration of a gear of other sizes than the article's"
        remedy = "Calibrate datasets/xb1-100-80, or leave the run out"
        raise InputError([Finding(draws.gear.name, words, remedy)])
