"""A parameter study: the force on gears of many sizes, every combination of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.plausible import implausible
from hdcal.design.assumptions import assumptions
from hdcal.design.checks import (
    name_findings,
    no_deformation,
    place_findings,
    size_findings,
    unseen_findings,
)
from hdcal.design.design_draws import DesignDraws, design_draws
from hdcal.design.sentences import beyond_tested, far_from_tested
from hdcal.design.sizes import geometry_with
from hdcal.errors import Finding, Findings, InputError
from hdcal.notebook import Shown
from hdcal.physics.profile import peak_stress
from hdcal.prediction.engine.gear_forces import gear_forces
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.sizes import SIZES, stiffness_ratio

AXES = (*SIZES, "deformation_mm", "temperature_C")
MOST_DESIGNS, MOST_AXES, MOST_MATERIALS = 100_000, 4, 20
# Forces held at a time [numbers]: 16 MB.
_BLOCK = 2_000_000


@dataclass(frozen=True, repr=False)
class Study(Shown):
    """The force of every design; one entry of each column per design.

    Attributes:
        columns: material, the sizes, deformation and temperature by edge name;
            force_median_N, force_lo_N, force_hi_N with the sign of the deformation;
            stress_MPa, the median size of the hoop bending stress under the load.
        varied: names of the columns that were varied, in the order given.
        interval: probability inside the band.
        interval_kind: what kind of interval the band is.
        basis: what the draws belong to.
        assumptions: what is taken for granted, in words.
        warnings: what is extrapolated, in words.
    """

    columns: Mapping[str, np.ndarray]
    varied: tuple[str, ...]
    interval: float
    interval_kind: str
    basis: DesignDraws
    assumptions: tuple[str, ...]
    warnings: tuple[str, ...]


def study(
    source: Models | Gear,
    vary: Mapping[str, Sequence[float]],
    *,
    materials: Sequence[str] = (),
    deformation: float | None = None,
    temperature: float | None = None,
    interval: float = 0.95,
    seed: int = 0,
) -> Study:
    """Compute the force on a gear for every combination of sizes.

    Args:
        source: a calibration; or a gear, for intervals of its priors only.
        vary: values by name: wall_thickness_mm, radius_mm, length_mm, load_height_mm,
            deformation_mm, temperature_C.
        materials: names or .toml files; by default the gear's own.
        deformation: radial, of the gear, of either sign [mm]; by default its nominal
            one.
        temperature: [°C]; by default the reference temperature.
        interval: probability inside the band.
        seed: of the draws of priors.

    Returns:
        The designs, the last of `vary` varying fastest.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: holds everything that is wrong with the question.
    """
    draws = design_draws(source, seed=seed)
    try:
        axes = {name: np.atleast_1d(np.asarray(v, float)) for name, v in vary.items()}
    except (TypeError, ValueError) as error:
        remedy = "Give numbers by name; materials have an argument of their own"
        raise InputError(
            [Finding("vary", "what varies is no number", remedy)]
        ) from error
    axes = _with_place(draws, axes, deformation, temperature)
    with Findings() as wrong:
        wrong += _findings(draws, axes, materials, interval)
        listed = materials or [draws.material]
        made = [wrong.attempt(draws.of_material, name, seed) for name in listed]
    return _tabulated(draws, list(filter(None, made)), axes, interval)


def _with_place(draws: DesignDraws, axes, deformation, temperature) -> dict:
    """Return the axes with deformation and temperature among them."""
    nominal = draws.nominal_deformation
    # Without any number the finding about it is told with the others.
    at = np.nan if nominal is None else nominal
    own = {
        "deformation_mm": at if deformation is None else deformation,
        "temperature_C": (
            draws.gear.reference_temperature if temperature is None else temperature
        ),
    }
    rest = {n: np.array([float(v)]) for n, v in own.items() if n not in axes}
    return {**axes, **rest}


def _findings(draws: DesignDraws, axes, materials, interval) -> list[Finding]:
    findings = name_findings(axes, AXES, "vary")
    if findings:
        return findings
    count = prod(len(values) for values in axes.values()) * max(len(materials), 1)
    many = sum(len(values) > 1 for values in axes.values())
    if count > MOST_DESIGNS:
        words = f"{count} designs are more than {MOST_DESIGNS}"
        findings.append(Finding("vary", words, "Vary less, or in fewer steps"))
    if many > MOST_AXES:
        words = f"{many} sizes at a time are more than {MOST_AXES}"
        findings.append(Finding("vary", words, "Vary fewer of them together"))
    if len(materials) > MOST_MATERIALS or len(set(materials)) < len(materials):
        words = f"more than {MOST_MATERIALS} materials, or one of them twice"
        findings.append(Finding("materials", words, "Name each of a few once"))
    findings += implausible("interval", interval)
    sizes = {name: values for name, values in axes.items() if name in SIZES}
    findings += unseen_findings(draws, sizes)
    wrong = size_findings(draws, sizes)
    radius = sizes.get("radius_mm", np.array([draws.gear.geometry.radius]))
    least = float(np.min(radius)) if not wrong else np.inf
    at, warm = axes["deformation_mm"], axes["temperature_C"]
    if np.isnan(at).any():
        wrong.append(no_deformation())
        at = np.ones(1)
    names = "deformation", "temperature"
    return findings + wrong + place_findings(draws, at, warm, least, names)


def _tabulated(draws: DesignDraws, made, axes, interval: float) -> Study:
    """Return the study over materials, each with draws of its own."""
    tables = [_of_material(one, axes, interval) for one in made]
    sizes = {name: values for name, values in axes.items() if name in SIZES}
    varied = [name for name, values in axes.items() if len(values) > 1]
    return Study(
        columns={n: np.concatenate([t[n] for t in tables]) for n in tables[0]},
        varied=(*(["material"] if len(made) > 1 else []), *varied),
        interval=interval,
        interval_kind=draws.interval_kind,
        basis=draws,
        assumptions=tuple(dict.fromkeys(w for one in made for w in assumptions(one))),
        warnings=(
            *beyond_tested(draws, axes["deformation_mm"], axes["temperature_C"]),
            *far_from_tested(draws, sizes),
            *draws.misfits,
        ),
    )


def _of_material(draws: DesignDraws, axes, interval: float) -> dict[str, np.ndarray]:
    grids = np.meshgrid(*axes.values(), indexing="ij")
    table = {name: grid.ravel() for name, grid in zip(axes, grids, strict=True)}
    sizes = {name: values for name, values in table.items() if name in SIZES}
    drawing = geometry_with(draws.drawing, sizes)
    at, warm = table["deformation_mm"], table["temperature_C"]
    factor = stiffness_ratio(drawing, draws.gear.geometry, draws.theory)
    factor = np.broadcast_to(factor, at.shape)
    tails = np.array([0.5, 0.5 - interval / 2.0, 0.5 + interval / 2.0])
    forces = force_quantiles(draws, factor, at, warm, tails)
    modulus, loss = (np.median(draws.values[name]) for name in ("E0", "alpha"))
    warm_modulus = modulus * (1.0 - loss * (warm - draws.gear.reference_temperature))
    stress = np.broadcast_to(peak_stress(drawing, warm_modulus, np.abs(at)), at.shape)
    named = ("force_median_N", "force_lo_N", "force_hi_N")
    return {
        "material": np.full(len(at), draws.material),
        **table,
        **dict(zip(named, forces, strict=True)),
        "stress_MPa": np.asarray(stress),
    }


def force_quantiles(
    draws: DesignDraws,
    factor: np.ndarray,
    deformation: np.ndarray,
    temperature: np.ndarray,
    shares: np.ndarray,
) -> np.ndarray:
    """Return quantiles of the force over the draws for every design.

    Args:
        draws: n of them.
        factor: stiffness over the tested gear's [-], shape (d,).
        deformation: radial, of the gear [mm], shape (d,).
        temperature: [°C], shape (d,).
        shares: probabilities, shape (q,).

    Returns:
        Forces [N], shape (q, d).
    """
    if any(effect.stage == "force" for effect in draws.problem.effects):
        return general_quantiles(draws, factor, deformation, temperature, shares)
    # Multiplied by a positive number no draw changes its rank: the quantiles of the
    # tested gear at each place serve all sizes, and where the force is a straight line
    # those at 1 mm for each sense of loading every deformation.
    line = draws.within_tested(deformation) & is_linear(draws)
    found = np.empty((len(shares), len(factor)))
    for rows, at, scale, basis in (
        (
            line,
            np.sign(deformation),
            np.abs(deformation),
            replace(draws, untested=None),
        ),
        (~line, deformation, np.ones_like(deformation), draws),
    ):
        if rows.any():
            places = np.stack([at, temperature])[:, rows]
            (way, levels), which = np.unique(places, axis=1, return_inverse=True)
            ones = np.ones_like(levels)
            unit = general_quantiles(basis, ones, way, levels, shares)
            found[:, rows] = unit[:, which] * (factor * scale)[rows]
    return found


def is_linear(draws: DesignDraws) -> bool:
    """Tell whether the model's force is proportional to stiffness and deformation."""
    bent = any(effect.stage == "force" for effect in draws.problem.effects)
    return not bent and draws.problem.discrepancy is None


def general_quantiles(draws, factor, deformation, temperature, shares) -> np.ndarray:
    """Evaluate every draw for every design, a block of designs at a time.

    Args and returns are those of `force_quantiles`.
    """
    size = min(max(1, _BLOCK // draws.size), len(factor))
    values, found = dict(draws.values), []
    for start in range(0, len(factor), size):
        rows = slice(start, start + size)
        at, warm, scale = (
            _filled(a[rows], size) for a in (deformation, temperature, factor)
        )
        where = at, warm, scale, draws.untested
        forces = np.asarray(gear_forces(draws.problem, values, *where))
        found.append(np.quantile(forces[: len(factor[rows])], shares, axis=1))
    return np.concatenate(found, axis=1)


def _filled(values: np.ndarray, size: int) -> np.ndarray:
    # Blocks of one length compile once.
    return np.concatenate([values, np.full(size - len(values), values[0])])
