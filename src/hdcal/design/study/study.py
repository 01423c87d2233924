"""A parameter study: the force on gears of many sizes, every combination of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import prod

import jax
import numpy as np

from hdcal.data.case import Gear
from hdcal.design.checks import (
    name_findings,
    no_deformation,
    place_findings,
    size_findings,
    unseen_findings,
)
from hdcal.design.design_draws import Basis, basis_of
from hdcal.design.sentences import beyond_tested, far_from_tested
from hdcal.design.sizes import (
    SIZES,
    geometry_with,
    stiffness_factor,
)
from hdcal.errors import Finding, InputError, attempt
from hdcal.inference.posterior import Posterior
from hdcal.physics.profile import peak_stress
from hdcal.prediction.forces import gear_force

SCHEMA = "hdcal.study/1"
AXES = (*SIZES, "deformation_mm", "temperature_C")
MOST_DESIGNS, MOST_AXES, MOST_MATERIALS = 100_000, 4, 20
# Forces held at a time [numbers]: 16 MB.
_BLOCK = 2_000_000


@dataclass(frozen=True)
class Study:
    """The force of every design; one entry of each column per design.

    Attributes:
        columns: material, the sizes, deformation and temperature by edge name;
            force_median_N, force_lo_N, force_hi_N; stress_MPa, the median hoop bending
            stress under the load.
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
    basis: Basis
    assumptions: tuple[str, ...]
    warnings: tuple[str, ...]

    def _repr_html_(self) -> str:
        from hdcal.design.study.document import study_document
        from hdcal.design.study.summary import study_answer
        from hdcal.report.html import notebook_html

        return notebook_html(study_document(study_answer(self)))


def study(
    source: Posterior | Gear,
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
        deformation: radial, of the gear [mm]; by default its nominal one.
        temperature: [°C]; by default the reference temperature.
        interval: probability inside the band.
        seed: of the draws of priors.

    Returns:
        The designs, the last of `vary` varying fastest.

    Raises:
        NotUsable: the calibration failed its checks.
        InputError: holds everything that is wrong with the question.
    """
    basis = basis_of(source, seed=seed)
    axes = {name: np.atleast_1d(np.asarray(v, float)) for name, v in vary.items()}
    axes = _with_place(basis, axes, deformation, temperature)
    findings = _findings(basis, axes, materials, interval)
    listed = materials or [basis.material]
    tried = [attempt(findings, basis.of_material, name, seed) for name in listed]
    if findings:
        raise InputError(findings)
    made = [one for one in tried if one is not None]
    tables = [_of_material(one, axes, interval) for one in made]
    sizes = {name: values for name, values in axes.items() if name in SIZES}
    varied = [name for name, values in axes.items() if len(values) > 1]
    return Study(
        columns={n: np.concatenate([t[n] for t in tables]) for n in tables[0]},
        varied=(*(["material"] if len(made) > 1 else []), *varied),
        interval=interval,
        interval_kind=basis.interval_kind,
        basis=basis,
        assumptions=tuple(dict.fromkeys(w for one in made for w in one.assumptions)),
        warnings=(
            *beyond_tested(basis, axes["deformation_mm"], axes["temperature_C"]),
            *far_from_tested(basis, sizes),
            *basis.misfits,
        ),
    )


def _with_place(basis: Basis, axes, deformation, temperature) -> dict[str, np.ndarray]:
    """Return the axes with deformation and temperature among them."""
    nominal = basis.nominal_deformation
    # Without any number the finding about it is told with the others.
    at = np.nan if nominal is None else nominal
    own = {
        "deformation_mm": at if deformation is None else deformation,
        "temperature_C": (
            basis.gear.reference_temperature if temperature is None else temperature
        ),
    }
    rest = {n: np.array([float(v)]) for n, v in own.items() if n not in axes}
    return {**axes, **rest}


def _findings(basis: Basis, axes, materials, interval) -> list[Finding]:
    findings = name_findings(axes, AXES, "--vary")
    if findings:
        return findings
    count = prod(len(values) for values in axes.values()) * max(len(materials), 1)
    many = sum(len(values) > 1 for values in axes.values())
    if count > MOST_DESIGNS:
        words = f"{count} designs are more than {MOST_DESIGNS}"
        findings.append(Finding("--vary", words, "Vary less, or in fewer steps"))
    if many > MOST_AXES:
        words = f"{many} sizes at a time are more than {MOST_AXES}"
        findings.append(Finding("--vary", words, "Vary fewer of them together"))
    if len(materials) > MOST_MATERIALS or len(set(materials)) < len(materials):
        words = f"more than {MOST_MATERIALS} materials, or one of them twice"
        findings.append(Finding("--material", words, "Name each of a few once"))
    if not 0.0 < interval < 1.0:
        words = f"{interval} is not between 0 and 1"
        findings.append(Finding("--interval", words, "Use e.g. 0.95"))
    sizes = {name: values for name, values in axes.items() if name in SIZES}
    findings += unseen_findings(sizes, basis.theory, "--vary")
    wrong = size_findings(basis, sizes, "--vary")
    radius = sizes.get("radius_mm", np.array([basis.gear.geometry.radius]))
    least = float(np.min(radius)) if not wrong else np.inf
    place = axes["deformation_mm"], axes["temperature_C"]
    if np.isnan(place[0]).any():
        wrong.append(no_deformation())
        place = np.ones(1), place[1]
    return findings + wrong + place_findings(basis, *place, least)


def _of_material(basis: Basis, axes, interval: float) -> dict[str, np.ndarray]:
    grids = np.meshgrid(*axes.values(), indexing="ij")
    table = {name: grid.ravel() for name, grid in zip(axes, grids, strict=True)}
    sizes = {name: values for name, values in table.items() if name in SIZES}
    geometry = geometry_with(basis.gear.geometry, sizes)
    at, warm = table["deformation_mm"], table["temperature_C"]
    factor = np.broadcast_to(stiffness_factor(basis, geometry), at.shape)
    tails = np.array([0.5, 0.5 - interval / 2.0, 0.5 + interval / 2.0])
    forces = force_quantiles(basis, factor, at, warm, tails)
    modulus = np.median(np.asarray(basis.values["E0"]))
    loss = np.median(np.asarray(basis.values["alpha"]))
    warm_modulus = modulus * (1.0 - loss * (warm - basis.gear.reference_temperature))
    stress = np.broadcast_to(peak_stress(geometry, warm_modulus, at), at.shape)
    named = ("force_median_N", "force_lo_N", "force_hi_N")
    return {
        "material": np.full(len(at), basis.material),
        **table,
        **dict(zip(named, forces, strict=True)),
        "stress_MPa": np.asarray(stress),
    }


def force_quantiles(
    basis: Basis,
    factor: np.ndarray,
    deformation: np.ndarray,
    temperature: np.ndarray,
    shares: np.ndarray,
) -> np.ndarray:
    """Return quantiles of the force over the draws for every design.

    Args:
        basis: of n draws.
        factor: stiffness over the tested gear's [-], shape (d,).
        deformation: radial, of the gear [mm], shape (d,).
        temperature: [°C], shape (d,).
        shares: probabilities, shape (q,).

    Returns:
        Forces [N], shape (q, d).
    """
    if is_linear(basis):
        return _linear_quantiles(basis, factor, deformation, temperature, shares)
    return general_quantiles(basis, factor, deformation, temperature, shares)


def is_linear(basis: Basis) -> bool:
    """Tell whether the force is proportional to stiffness and deformation."""
    bent = any(effect.stage == "force" for effect in basis.problem.effects)
    return not bent and basis.problem.discrepancy is None


def _linear_quantiles(basis, factor, deformation, temperature, shares) -> np.ndarray:
    """Scale one gear's quantiles: multiplied by a positive number, none changes rank.

    The force is factor · ω times that of the tested gear at 1 mm: one evaluation of
    every draw for each temperature serves all designs.
    """
    levels, which = np.unique(temperature, return_inverse=True)
    one = np.ones_like(levels)
    unit = general_quantiles(basis, one, one, levels, shares)
    return unit[:, which] * (factor * deformation)


def general_quantiles(basis, factor, deformation, temperature, shares) -> np.ndarray:
    """Evaluate every draw for every design, a block of designs at a time.

    Args and returns are those of `force_quantiles`.
    """
    size = min(max(1, _BLOCK // basis.size), len(factor))
    values = jax.tree.map(np.asarray, dict(basis.values))
    found = []
    for start in range(0, len(factor), size):
        rows = slice(start, start + size)
        place = [_filled(a[rows], size) for a in (factor, deformation, temperature)]
        forces = np.asarray(all_forces(basis.problem, values, *place))
        found.append(np.quantile(forces[: len(factor[rows])], shares, axis=1))
    return np.concatenate(found, axis=1)


def _filled(values: np.ndarray, size: int) -> np.ndarray:
    # Blocks of one length compile once.
    return np.concatenate([values, np.full(size - len(values), values[0])])


@jax.jit
def all_forces(problem, values, factor, deformation, temperature):
    """Return the force of every draw on every design: [design, draw]."""
    one = partial(gear_force, problem)

    def of_draw(value):
        return one(value, deformation, temperature, factor=factor)

    return jax.vmap(of_draw, out_axes=1)(values)
