"""What is wrong with the questions that are asked of a margin."""

from collections.abc import Mapping, Sequence

import numpy as np

from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import case_reading
from hdcal.prediction.bands.bands import DIRECTIONS
from hdcal.prediction.forces import QUANTITIES
from hdcal.prediction.population import check_population
from hdcal.prediction.population_force import MOST_DRAWS
from hdcal.prediction.size_tolerances import check_tolerances
from hdcal.prediction.tolerance_factors import check_shares

# A force this many times larger or smaller than the one needed is a slip of the unit.
_OFF = 100.0
# Draws that must lie beyond a bound: fewer do not say where it is.
_BEYOND = 10
# The normal law is no guide to shares rarer than this.
_RAREST = 1e-9

Models = Posterior | Sequence[tuple[float, Posterior]]


def usable_members(models: Models) -> list[tuple[float, Posterior]]:
    """Return models with probabilities that sum to 1.

    Raises:
        NotUsable: a calibration failed its checks.
        InputError: there are none, or they are not of the same data.
    """
    listed = [(1.0, models)] if isinstance(models, Posterior) else list(models)
    total = sum(share for share, _ in listed)
    cases = {model.case.data_sha256 for _, model in listed}
    if not listed or not total > 0.0 or any(share < 0.0 for share, _ in listed):
        words, remedy = "hold no probability", "Give (probability, posterior) pairs"
        raise InputError([Finding("models", words, remedy)])
    if len(cases) > 1:
        words, remedy = "are not of the same data", "Give models of one case"
        raise InputError([Finding("models", words, remedy)])
    for _, model in listed:
        model.require_usable()
    return [(share / total, model) for share, model in listed if share > 0.0]


def check_margin(
    posterior: Posterior,
    *,
    deformation: float,
    temperature: np.ndarray,
    forces: Mapping[str, float | None],
    shares: Mapping[str, float],
    draws: int,
    population: str | None,
    quantity: str,
    direction: str,
    tolerances: Mapping[str, float],
) -> None:
    """Refuse what cannot be asked, all of it at once.

    Args:
        posterior: of the likeliest model.
        deformation: as read [mm].
        temperature: of the specimen [°C].
        forces: limit_force and given_force [N], or None.
        shares: content, confidence and, where given, required_probability.
        draws: of all models.
        population: whose force, or None.
        quantity: which force.
        direction: of the movement.
        tolerances: ± mm by name.

    Raises:
        InputError: holds every finding.
    """
    gear = posterior.case.gear
    findings = [
        *_check_deformation(posterior, deformation),
        *_check_temperature(posterior, temperature),
        *check_shares(**shares),
        *_check_rarity(shares, draws),
        *check_population(population, posterior.problem),
        *check_tolerances(tolerances, gear.geometry, posterior.theory),
        *_check_forces(posterior, deformation, forces),
    ]
    for option, value, known in (
        ("--quantity", quantity, QUANTITIES),
        ("--direction", direction, DIRECTIONS),
    ):
        if value not in known:
            remedy = f"Use {' or '.join(known)}"
            findings.append(Finding(option, f"'{value}' is unknown", remedy))
    if findings:
        raise InputError(findings)


def _check_deformation(posterior: Posterior, deformation: float) -> list[Finding]:
    reading = case_reading(posterior.case)
    radius = posterior.case.gear.geometry.radius
    if not np.isfinite(deformation) or deformation == 0.0:
        words = f"{deformation:g} mm is no deformation"
        return [Finding("--deformation", words, "Give a number of mm")]
    if abs(deformation) >= radius / reading.radial_per_read:
        words = f"{deformation:g} mm on a radius of {radius:g} mm"
        return [Finding("--deformation", words, "Give it in mm")]
    return []


def _check_temperature(posterior: Posterior, temperature) -> list[Finding]:
    def refuse(words: str, remedy: str) -> list[Finding]:
        return [Finding("--temperature", words, remedy)]

    if temperature.size == 0 or not np.isfinite(temperature).all():
        return refuse("is an empty window", "Give it like -20:80, in °C")
    if temperature.min() < -273.15:
        return refuse("is below absolute zero", "Give it in °C")
    rise = np.abs(temperature - posterior.case.gear.reference_temperature).max()
    if np.median(posterior.draws["alpha"]) * rise >= 0.5:
        words = "the linear law E(T) would lose half of Young's modulus"
        return refuse(words, "Give it in °C")
    return []


def _check_rarity(shares: Mapping[str, float], draws: int) -> list[Finding]:
    """Refuse what these draws, or any normal law, cannot tell."""
    findings = []
    sure, most = shares["confidence"], 1.0 - _BEYOND / draws
    if most < sure < 1.0:
        words = f"{draws} draws cannot tell a confidence of {sure:g}"
        more = ", or calibrate with more --draws" if draws < MOST_DRAWS else ""
        remedy = f"Ask for {most:.4g} or less{more}"
        findings.append(Finding("--confidence", words, remedy))
    for name in shares.keys() - {"confidence"}:
        if 1.0 - _RAREST < shares[name] < 1.0:
            words = f"{shares[name]:.12g} is beyond what any model of noise can promise"
            remedy = "Ask for 0.999999999 or less"
            option = f"--{name.replace('_', '-')}"
            findings.append(Finding(option, words, remedy))
    return findings


def _check_forces(posterior: Posterior, deformation, forces) -> list[Finding]:
    scale = abs(float(np.median(posterior.draws["stiffness"])) * deformation)
    findings = []
    for name, force in forces.items():
        option = f"--{name.replace('_', '-')}"
        if force is None:
            continue
        if not np.isfinite(force) or force == 0.0:
            words = f"{force:g} N is no force"
            findings.append(Finding(option, words, "Give a number of N"))
        elif scale > 0.0 and not scale / _OFF < abs(force) < scale * _OFF:
            words = f"{force:g} N, where {deformation:g} mm takes about {scale:.3g} N"
            findings.append(Finding(option, words, "Give it in N"))
    return findings
