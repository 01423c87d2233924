"""Uncertainty budget of one member's force by Monte Carlo (JCGM 101:2008).

The variance splits without a remainder. What differs between members adds up within
each draw. The variance over the draws is divided in a stated order: each input takes
what a regression on it explains of what the inputs before it left. Nothing is
linearised but the sensitivity that is printed.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from pydantic import Field

from hdcal.prediction.joint import JointModel
from hdcal.prediction.members import Members
from hdcal.report.item import Item, Probability, Words, quantity

# A correlation of this many standard errors, or less, may be chance in the draws: over
# ten inputs one in a thousand budgets shows a larger one.
_CHANCE = 4.0
# A row with a smaller share of the variance is added to the calibration.
_LEAST_SHARE = 1e-4
# Inputs by their label, their unit, their distribution, and the parameter that tells
# their type: A where the readings determine it.
_INPUTS: dict[str, tuple[str, str, str, str]] = {
    "noise": ("reading noise", "N", "normal", "sigma"),
    "rounding": ("resolution of the {load} reading", "N", "rectangular", ""),
    "mounting": ("scatter between mountings", "N", "normal", "run_offset_sd"),
    "gear": ("scatter between gears", "N", "normal", "specimen_sd"),
    "wall_thickness": ("tolerance of the wall thickness", "N", "rectangular", ""),
    "radius": ("tolerance of the radius", "N", "rectangular", ""),
    "length": ("tolerance of the length", "N", "rectangular", ""),
    "load_height": ("tolerance of the load height", "N", "rectangular", ""),
    "cause": ("which effect acts", "N", "discrete", "stiffness"),
    "bend": ("curvature that the readings do not exclude", "N", "posterior", "bend"),
    "discrepancy": ("fitted discrepancy", "N", "posterior", "bend"),
    "zero_drift": ("zero drift of the gauge with temperature", "N", "normal", ""),
    "frame_drift": ("expansion of the rig with temperature", "mm", "normal", ""),
    "alpha": ("loss of modulus per kelvin", "1/K", "prior", ""),
    "deformation_offset": ("position of first contact", "mm", "prior", ""),
    "force_offset": ("zero of the {load} gauge", "N", "posterior", "force_offset"),
    "force_gain": ("{load} gauge, certificate", "1", "normal", ""),
    "deformation_gain": ("displacement gauge, certificate", "1", "normal", ""),
    "temperature_offset": ("thermometer, certificate", "K", "normal", ""),
    "calibration": ("calibration (stiffness, zeros, effects)", "N", "posterior", "K"),
}
# Read from the data whatever their diagnostics say.
_TYPE_A = {"stiffness", "bend", "K"}


class BudgetRow(Item):
    """One component of the uncertainty; the shares of all rows sum to 1.

    Type A where the readings determine it, B by other knowledge (JCGM 100). The input
    is a key of `_INPUTS`.
    """

    input: str = Field(exclude=True)
    component: Words = quantity("component")
    type_: Literal["A", "B"] = quantity("type")
    distribution: Words = quantity("distribution")
    standard_uncertainty: float = quantity("standard uncertainty")
    unit: str = quantity("unit")
    sensitivity_N_per_unit: float = quantity("sensitivity", "N per unit")
    contribution_N: float = quantity("contribution", "N")
    share: Probability = quantity("share of the variance")


def divided(
    output: np.ndarray, inputs: Mapping[str, np.ndarray], rest: str
) -> dict[str, tuple[float, float, float]]:
    """Divide the variance of an output among its inputs by regression on their draws.

    Inputs take their part in the order given; `rest` names what none explains.

    Returns:
        By name the variance that the inputs before it left of the input, its covariance
        with what they left of the output, and the part of the variance of the output.
        The parts sum to that variance.
    """
    left, basis = output - output.mean(), np.empty((len(output), 0))
    parts: dict[str, tuple[float, float, float]] = {}
    for name, values in inputs.items():
        centred = values - values.mean()
        column = centred - basis @ (basis.T @ centred)
        size = float(np.linalg.norm(column))
        if not size > 1e-9 * np.linalg.norm(centred):
            continue
        axis = column / size
        along = float(axis @ left)
        if along**2 > _CHANCE**2 * (left @ left) / len(left):
            count = len(left)
            parts[name] = size**2 / count, size * along / count, along**2 / count
            basis, left = np.column_stack([basis, axis]), left - axis * along
    variance = float(np.var(left))
    return parts | {rest: (variance, variance, variance)}


def budget(
    model: JointModel, members: Members, rounding_sd: float, direction: int
) -> tuple[tuple[BudgetRow, ...], float, float]:
    """Return the rows of the budget, the estimate and its standard uncertainty [N].

    The members are at one condition; the estimate has the sign of the force.
    """
    centre = members.centre[:, 0]
    estimate = float(centre.mean())
    found = {"cause": np.zeros(3), "rounding": np.full(3, rounding_sd**2)}
    # Within each model, and between them: one cause has no share in another's inputs.
    for number in range(len(model.models)):
        mine = model.number == number
        common = {name: values[mine, 0] for name, values in members.common.items()}
        rows: dict = divided(centre[mine], common, "calibration")
        for name, values in members.scatter.items():
            within = np.full(3, float(np.mean(values[mine])))
            rows[name] = within + rows.get(name, np.zeros(3))
        rows["cause"] = (float(np.mean(centre[mine]) - estimate) ** 2,) * 3
        for name, row in rows.items():
            more = np.mean(mine) * np.array(row)
            found[name] = found.get(name, np.zeros(3)) + more
    total = float(sum(row[2] for row in found.values()))
    rest = found.pop("calibration")
    for name in [n for n, row in found.items() if row[2] <= _LEAST_SHARE * total]:
        rest = rest + found.pop(name)[2]
    found["calibration"] = rest
    listed = [_row(n, row, total, model, direction) for n, row in found.items()]
    ranked = sorted(listed, key=lambda row: -row.share)
    return tuple(ranked), direction * estimate, total**0.5


def _row(name: str, row, total: float, model: JointModel, direction: int) -> BudgetRow:
    own, tied, variance = map(float, row)
    label, unit, distribution, site = _INPUTS[name]
    contribution = variance**0.5
    in_newtons = unit == "N" and name != "force_offset"
    # So that standard uncertainty times sensitivity is the contribution.
    slope = np.sign(direction * tied) * (variance / own) ** 0.5
    sites, units = [site] if site else [], model.posterior.case.units
    if name == "noise":
        noises = {effect.name for effect in model.effects if effect.stage == "noise"}
        sites += [n for n in model.draws if n.partition(".")[0] in noises]
    by_data = site in _TYPE_A or any(model.driver(each) == "data" for each in sites)
    return BudgetRow(
        input=name,
        component=label.format(load=units.load),
        type_="A" if by_data else "B",
        distribution=distribution,
        standard_uncertainty=contribution if in_newtons else own**0.5,
        unit=units.unit(unit),
        sensitivity_N_per_unit=1.0 if in_newtons else float(slope),
        contribution_N=contribution,
        share=variance / total if total > 0.0 else 0.0,
    )
