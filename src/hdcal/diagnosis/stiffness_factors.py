"""K as a product of physical factors: what one curve can and cannot split."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from hdcal.data.case import Case, Gear
from hdcal.data.gear_file.certificates import GAINS
from hdcal.data.theory_names import SPRING
from hdcal.diagnosis.budget import Budget, BudgetPart
from hdcal.evidence.case_evidence import CaseEvidence
from hdcal.evidence.design_matrix import fit_design
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.prepare import log_moments
from hdcal.inference.distributions import moments
from hdcal.physics.theory import THEORIES
from hdcal.report.intervals import INTERVAL, Interval

_Z = float(ndtri(0.5 + 0.5 * INTERVAL))
# Half of a range that was read off drawings, in sds: nine of ten lie in it.
_RANGE_Z = 1.645
# Sizes of the causes, each with its source of size.
WALL_SD_MM, RADIUS_SD_MM, HEIGHT_SD_MM = 0.0133, 0.05, 3.0
# Below this sd of its log a factor is a number that was given, not one to be freed.
_GIVEN = 1e-6
_NOTE = (
    "Only the product is measured: the parts are prior belief divided among causes in "
    "proportion to how uncertain each was."
)


def stiffness_budget(
    evidence: CaseEvidence,
    case: Case,
    names: Sequence[str] = (),
    stiffness: np.ndarray | None = None,
) -> Budget | None:
    """Split K into factors by prior and likelihood in log space; a spring has none.

    log K = Σ log f_i with log f_i ~ N(m_i, s_i²): given the measured log K each part
    takes up the surprise in proportion to its variance. K is that of the ring formula
    at the prior's mean modulus, whatever the gear's theory: the parts are what the
    ring formula leaves out.

    Args:
        evidence: for the fitted stiffness.
        case: the gear.
        names: effects beside which the stiffness is fitted.
        stiffness: draws of it as read where it was sampled [N/mm].
    """
    if case.gear.theory == SPRING:
        return None
    causes = _causes(case)
    if stiffness is None:
        log_k, log_k_sd = _measured(evidence, names)
    else:
        half = 0.5 if case.gear.reading == "diametral" else 1.0
        drawn = np.log(stiffness / (half * float(evidence.prepared.ring)))
        log_k, log_k_sd = float(np.median(drawn)), float(np.std(drawn))
    mean = np.array([m for _, m, _, _ in causes])
    sd = np.array([s for _, _, s, _ in causes])
    whole = np.sum(sd**2) + log_k_sd**2
    surprise = log_k - mean.sum()
    after = mean + sd**2 / whole * surprise
    after_sd = np.sqrt(sd**2 - sd**4 / whole)
    parts = tuple(
        BudgetPart(
            name,
            _factor(after[i], after_sd[i]),
            _factor(mean[i], sd[i]),
            "data" if after_sd[i] < 0.5 * sd[i] else "prior",
            split_by if sd[i] > _GIVEN else "nothing: it is fixed, not free",
        )
        for i, (name, _, _, split_by) in enumerate(causes)
    )
    note = _NOTE + _own_theory(evidence, case, log_k)
    if abs(surprise) > 3.0 * np.sqrt(whole):
        note += (
            " The product lies further from 1 than these causes reach together: check "
            "whether the reading is diametral (a factor of 2) and the units."
        )
    return Budget(_factor(log_k, log_k_sd), "ring", parts, note)


def _own_theory(evidence: CaseEvidence, case: Case, log_k: float) -> str:
    """Say what K is by the gear's own formula, where that is not the ring's."""
    theory = case.gear.theory
    if theory == "ring":
        return ""
    own = np.exp(log_k) * evidence.prepared.ring / evidence.prepared.nominal
    return f" By the gear's own theory ({theory}) K is {own:.3g}."


def _factor(mean: float, sd: float) -> Interval:
    low, middle, high = np.exp(mean + sd * np.array([-_Z, 0.0, _Z]))
    return Interval(float(middle), float(low), float(high))


def _measured(evidence: CaseEvidence, names: Sequence[str]) -> tuple[float, float]:
    """Return log K by the ring formula at the prior's mean modulus, and its sd."""
    prepared = evidence.prepared
    design = design_of(evidence, names)
    fit = fit_design(prepared.rows, design, prepared.noise_sd, 0.0)
    # The first coefficient is the deviation of log stiffness, in prior sds.
    log_stiffness = prepared.log_stiffness + prepared.log_stiffness_sd * fit.mean[0]
    sd = prepared.log_stiffness_sd * np.sqrt(fit.covariance[0, 0])
    return float(log_stiffness - np.log(prepared.ring)), float(sd)


def _causes(case: Case) -> list[tuple[str, float, float, str]]:
    """Return name, mean and sd of the log factor, and what would split it off."""
    geometry = case.gear.geometry
    _, modulus_sd = log_moments(case.gear.priors["E0"], "E0")
    wall, radius = float(geometry.wall_thickness), float(geometry.radius)
    lower = replace(geometry, load_height=float(geometry.load_height) - HEIGHT_SD_MM)
    at_rim = float(THEORIES["cup"](geometry, 1.0))
    lever = abs(np.log(float(THEORIES["cup"](lower, 1.0)) / at_rim))
    tooth = np.log(np.array([1.3, 2.5]))
    return [
        (
            "tooth band",
            float(tooth.mean()),
            float(np.diff(tooth)[0] / (2.0 * _RANGE_Z)),
            "press a blank without teeth",
        ),
        (
            "closed end",
            0.3,
            0.3,
            "press the same gear at two heights from its base",
        ),
        ("load height", 0.0, float(lever), "measure the height of the load"),
        (
            "rig compliance",
            float(np.log(0.93)),
            0.045,
            "press a rigid block in place of the gear",
        ),
        (
            "wall thickness",
            0.0,
            3.0 * WALL_SD_MM / wall,
            "measure the wall at several places",
        ),
        (
            "radius to the mid-line",
            float(np.log1p(0.03)),
            float(np.hypot(0.025, 3.0 * RADIUS_SD_MM / radius)),
            "measure the outer diameter and the wall",
        ),
        ("modulus", 0.0, modulus_sd, "test a strip of the same material"),
        ("gauge gain", 0.0, _gain_sd(case.gear), "load the sensor with known weights"),
    ]


def _gain_sd(gear: Gear) -> float:
    """Return the sd of the gauges' gains together: certificates', or what is usual."""
    stated = [gear.gauge_priors[name] for name in GAINS if name in gear.gauge_priors]
    return float(np.hypot.reduce([moments(p)[1] for p in stated])) if stated else 0.005
