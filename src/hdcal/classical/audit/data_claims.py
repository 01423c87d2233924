"""Claims about the readings of Table 2: what the readings themselves give."""

from collections.abc import Iterator

import numpy as np

from hdcal.classical.audit.article import (
    CUBIC_R2,
    DEFORMATION,
    ERROR_CLAIMED,
    FORCE_CLAIMED,
    INFLUENCE,
    MODULUS,
    RADIUS,
    SLOPE_MEASURED,
    SLOPE_THEORY,
    TABLE_3,
    TABLE_4,
    WALL,
    Claim,
    article_gear,
    cubic,
    outcome,
)
from hdcal.classical.fit.fit import PolynomialFit, fit
from hdcal.data.case import Case
from hdcal.physics.theory import ring

_CHANCE = 0.05
# What a diagnosis of the curvature, or of friction and heat, would need to know.
_WANTED = {
    "unloading": "unloading",
    "rates": "a second speed",
    "run": "a repeat",
    "temperature": "a second temperature",
    "time": "time",
    "angle": "the angle",
}


def data_claims(case: Case) -> Iterator[Claim]:
    """Yield what came of the claims about the readings (points 5, 7 to 11)."""
    fits = {one.powers: one for one in fit(case, [1, 2, 3])}
    x, y = np.asarray(case.records.deformation), np.asarray(case.records.force)
    yield from _table_3(x, y)
    yield _within_five_percent(x, y, fits[0, 1, 2])
    yield _measured_slope(fits)
    yield _fitted_equation(x, y)
    yield _linear(fits[0, 1], fits[0, 1, 2])
    yield _third_degree(fits[0, 1, 2], fits[0, 1, 2, 3])
    yield _resolution(case, fits[0, 1], fits[0, 1, 2])
    yield from _influence(fits[0, 1], fits[1,])
    yield from _not_seen(case)


def _table_3(x, y) -> Iterator[Claim]:
    rows = [row for row in TABLE_3 if row[3] is not None]
    errors = [revised / measured - 1.0 for _, _, revised, measured in rows]
    yield Claim(
        5,
        "In Table 3 the revised force closely aligns with the measured one",
        "–",
        "Revised over measured: "
        + ", ".join(
            f"{e:+.1%} at {row[0]:g} mm" for e, row in zip(errors, rows, strict=True)
        ),
        outcome(max(map(abs, errors)) <= ERROR_CLAIMED),
        {f"error_at_{row[0]:g}_mm": e for e, row in zip(errors, rows, strict=True)},
    )
    beyond = [row[0] for row in TABLE_3 if row[0] > x.max()]
    yield Claim(
        5,
        f"Table 3 goes on to {beyond[-1]:g} mm",
        "A straight line, by assumption",
        f"Nothing was measured beyond {x.max():g} mm: the rows at "
        f"{' and '.join(f'{b:g}' for b in beyond)} mm extrapolate",
        "cannot be checked",
        {"rows_beyond": len(beyond), "largest_measured_mm": float(x.max())},
    )


def _within_five_percent(x, y, parabola: PolynomialFit) -> Claim:
    rule = INFLUENCE * SLOPE_THEORY * DEFORMATION
    table_4 = TABLE_4[WALL, RADIUS][1]
    measured = float(np.interp(DEFORMATION, x, y))
    at = parabola.at(DEFORMATION)
    error = table_4 / measured - 1.0
    return Claim(
        7,
        f"At {DEFORMATION:g} mm around {FORCE_CLAIMED:g} N are needed, within "
        f"{ERROR_CLAIMED:.0%} of the prediction",
        f"{rule:.1f} N by the rule of Table 3, {table_4:.1f} N in Table 4",
        f"Table 2 interpolates to {measured:.1f} N: {table_4:.1f} N is {error:+.0%}, "
        f"{rule:.1f} N {rule / measured - 1.0:+.0%}. A reading there would lie in "
        f"{at['reading_lo']:.1f} … {at['reading_hi']:.1f} N (95 % prediction interval "
        "of the parabola)",
        outcome(abs(FORCE_CLAIMED / measured - 1.0) <= ERROR_CLAIMED),
        {
            "rule_of_table_3_N": rule,
            "table_4_N": table_4,
            "measured_N": measured,
            "error": error,
            "error_of_rule": rule / measured - 1.0,
            "prediction_lo_N": at["reading_lo"],
            "prediction_hi_N": at["reading_hi"],
        },
    )


def _measured_slope(fits) -> Claim:
    line, origin = fits[0, 1], fits[1,]
    low, high = line.confidence[:, 1]
    return Claim(
        8,
        f"A linear fit gives the slope K₂ = {SLOPE_MEASURED:g} N/mm",
        "–",
        f"Least squares: {line.coefficients[1]:.2f} N/mm with intercept (95 % "
        f"confidence interval {low:.1f} … {high:.1f}), {origin.coefficients[0]:.2f} "
        "through the origin",
        outcome(bool(low < SLOPE_MEASURED < high)),
        {
            "slope_with_intercept_N_per_mm": float(line.coefficients[1]),
            "slope_lo_N_per_mm": float(low),
            "slope_hi_N_per_mm": float(high),
            "slope_through_origin_N_per_mm": float(origin.coefficients[0]),
        },
    )


def cubic_misfit(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return what the article's cubic leaves of the readings.

    Args:
        x: deformation [mm], shape (n,).
        y: force [N], shape (n,).

    Returns:
        Residuals, shape (n,), and their root mean square [N]; R² about the mean.
    """
    residual = y - cubic(x)
    r2 = 1.0 - residual @ residual / np.sum((y - y.mean()) ** 2)
    return residual, float(np.sqrt(np.mean(residual**2))), float(r2)


def _fitted_equation(x, y) -> Claim:
    residual, rms, r2 = cubic_misfit(x, y)
    below = int(np.sum(residual < 0.0))
    return Claim(
        8,
        "The fitted equation is 210.41ω − 15.23ω² + 5.67ω³, with R² above "
        f"{CUBIC_R2:g}",
        "It bends down over the tested range",
        f"{below} of {len(y)} readings lie below it, by {rms:.2f} N rms: R² = "
        f"{r2:.5f}. It is no least-squares fit of Table 2",
        outcome(r2 > CUBIC_R2),
        {"below": below, "rms_N": rms, "r2": r2},
    )


def _linear(line: PolynomialFit, parabola: PolynomialFit) -> Claim:
    lack, bend = line.lack_of_fit, float(parabola.coefficients[2])
    assert lack is not None  # Table 2 has rows to spare
    return Claim(
        8,
        "Force and deformation are linear",
        "The formula is linear",
        f"Curvature is real: F({lack.dof[0]}, {lack.dof[1]}) = {lack.F:.1f}, p = "
        f"{lack.p_value:.1g}; it is {'convex' if bend > 0.0 else 'concave'}, "
        f"{bend:+.1f} N/mm²: the gear stiffens",
        outcome(lack.p_value > _CHANCE),
        {"F": lack.F, "p_value": lack.p_value, "curvature_N_per_mm2": bend},
    )


def _third_degree(parabola: PolynomialFit, third: PolynomialFit) -> Claim:
    lack = parabola.lack_of_fit
    assert lack is not None
    return Claim(
        8,
        "A fit of third degree gives better accuracy",
        "–",
        f"The third-degree term is not supported: p = {lack.p_value:.2f}; errors on "
        f"rows left out are {third.held_out:.2f} N with it, {parabola.held_out:.2f} N "
        "without",
        outcome(lack.p_value < _CHANCE),
        {
            "p_value": lack.p_value,
            "held_out_with_N": float(third.held_out or np.nan),
            "held_out_without_N": float(parabola.held_out or np.nan),
        },
    )


def _resolution(case: Case, line: PolynomialFit, parabola: PolynomialFit) -> Claim:
    x, y = np.asarray(case.records.deformation), np.asarray(case.records.force)
    step = case.gear.force_resolution
    ticks = y / step
    on_tick = int(np.sum(np.abs(ticks - np.round(ticks)) < 1e-6))
    at = int(np.argmin(np.abs(x - 0.1)))
    high = [
        float(y[at] - x[at] ** np.array(one.powers) @ one.coefficients)
        for one in (parabola, line)
    ]
    return Claim(
        9,
        "The forces were measured precisely by sensor and acquisition card",
        "–",
        f"{on_tick} of {len(y)} forces are multiples of {step:g} N, that is 0.1 kgf: "
        f"they were read on a scale. The row at {x[at]:g} mm lies {high[0]:.1f} to "
        f"{high[1]:.1f} N high",
        outcome(on_tick < len(y) / 2),
        {
            "on_tick": on_tick,
            "rows": len(y),
            "high_over_parabola_N": high[0],
            "high_over_line_N": high[1],
        },
    )


def _influence(line: PolynomialFit, origin: PolynomialFit) -> Iterator[Claim]:
    slopes = (float(line.coefficients[1]), float(origin.coefficients[0]))
    nominal = float(ring(article_gear(), MODULUS))
    article = [slope / SLOPE_THEORY for slope in slopes]
    proper = [slope / nominal for slope in slopes]
    numbers = {
        "K_article_with_intercept": article[0],
        "K_article_through_origin": article[1],
        "K_ring_with_intercept": proper[0],
        "K_ring_through_origin": proper[1],
    }
    yield Claim(
        10,
        f"The influence coefficient is K = K₂/K₁ = {INFLUENCE:g}",
        f"{SLOPE_MEASURED:g} / {SLOPE_THEORY:g} = {SLOPE_MEASURED / SLOPE_THEORY:.4f}",
        f"{article[0]:.4f} (slope with intercept) to {article[1]:.4f} (through the "
        "origin), as a ratio to a K₁ that cannot be reproduced",
        outcome(round(article[0], 2) == INFLUENCE),
        numbers,
    )
    yield Claim(
        10,
        f"K = {INFLUENCE:g} accounts for the teeth",
        "Teeth and the closed end stiffen the gear: K above 1 is the physical sign",
        f"Against the corrected ring K = {proper[0]:.2f} to {proper[1]:.2f}; the "
        f"article's {INFLUENCE:g} would say that teeth take away "
        f"{1.0 - INFLUENCE:.0%} of the stiffness",
        outcome(INFLUENCE > 1.0),
        numbers,
    )


def _not_seen(case: Case) -> Iterator[Claim]:
    known = case.records.known
    lacking = [words for name, words in _WANTED.items() if name not in known]
    one_way = bool(np.all(np.diff(case.records.deformation) > 0.0))
    ramp = "one rising ramp" if one_way else "not one rising ramp"
    yield Claim(
        11,
        "The difference from theory is due to the teeth",
        "–",
        f"Table 2 is {ramp}, without {', '.join(lacking)}: it shows that the curve is "
        "convex, and cannot show why",
        "cannot be checked",
        {"lacking": len(lacking), "one_rising_ramp": float(one_way)},
    )
    yield Claim(
        11,
        "Young's modulus falls with temperature, E = E₀ (1 − α ΔT)",
        "Right for metals; α is not given",
        "Table 2 holds no temperature",
        "cannot be checked",
    )
    yield Claim(
        11,
        "The measured deformation is twice the actual one",
        "If so, K would be twice as large",
        "Table 2 is plotted without dividing by two; the readings cannot tell",
        "cannot be checked",
    )
