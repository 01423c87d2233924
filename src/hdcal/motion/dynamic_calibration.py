"""Calibrate mass, damping and stiffness against a gear that was seen to move."""

import time
from collections.abc import Sequence
from functools import partial

import jax
import numpy as np

from hdcal.data.case import Case, Theory, require_case, require_force
from hdcal.errors import Finding, InputError
from hdcal.exported import jit
from hdcal.inference import laplace
from hdcal.inference.assembly import (
    MOST_LOG_LIKELIHOODS,
    Specifics,
    assemble,
    run_settings,
)
from hdcal.inference.checks import Check
from hdcal.inference.sample import (
    Draws,
    Progress,
    check_settings,
    sample,
)
from hdcal.motion.dynamic_posterior import LOSS, DynamicPosterior
from hdcal.motion.dynamic_priors import dynamic_site_priors
from hdcal.motion.dynamic_problem import DynamicProblem, build_dynamic, pointwise
from hdcal.motion.frequency_scan import scan
from hdcal.motion.friction_search import motion_slopes
from hdcal.motion.loss import (
    WHITE,
    WHITENESS,
    Chosen,
    choose_loss,
    loss_effects,
    noise_probability,
)

FEWEST_ROWS = 20
_PEAKS = 3
# A second peak of the density lower by less than this [nat] was wrongly left out.
_RIVAL = 7.0
# Peaks nearer than this, in posterior sds of the first, are one.
_SAME = 5.0
_DERIVED = ("stiffness", "damping", "natural_frequency")


def calibrate_dynamic(
    case: Case,
    *,
    effects: Sequence[str] | None = None,
    theory: Theory | None = None,
    chains: int = 4,
    warmup: int = 1000,
    draws: int = 1000,
    seed: int = 0,
    progress: Progress | None = None,
) -> DynamicPosterior:
    """Calibrate m ÿ + c ẏ + k y = F(t), or with dry friction, against a time series.

    The force is the input, as read and linear between the rows; the deformation is the
    output, y plus a zero of its own plus white noise; k follows the temperature.

    Args:
        case: from `read_case`; one run, with time.
        effects: `coulomb_friction`, or none for the linear model; by default that one,
            and the loss is named beside it where the record can tell.
        theory: overrides the gear's theory.
        chains: independent chains, two or more.
        warmup: iterations of adaptation per chain.
        draws: draws kept per chain.
        seed: of `jax.random.key`; the same seed gives the same draws.
        progress: called with (iterations done, iterations in all).

    Returns:
        The posterior; it may have failed its checks, see `Posterior.usable`.

    Raises:
        InputError: the record or an effect is none that the model can be held against.
    """
    require_case(case)
    require_force(case, "calibrate with --dynamic")
    check_settings(chains, warmup, draws, seed)
    loss_effects(effects or ())
    check_motion(case)
    began = time.perf_counter()
    theory = theory or case.gear.theory
    chosen, rival = _chosen(case, theory, effects)
    problem, priors = chosen.problem, chosen.priors
    size = {"chains": chains, "warmup": warmup, "draws": draws}
    found = sample(problem, chosen.whitening, seed, progress=progress, **size)
    settings: dict[str, object] = {"seed": seed, **size, "with_gap": False}
    own = _specifics(problem, found, (rival, *chosen.checks))
    parts = assemble(case, priors, problem, found, own, seed)
    settings |= run_settings(found, began)
    settings |= {LOSS: chosen.probabilities} if chosen.probabilities else {}
    return DynamicPosterior(case, theory, problem.effects, priors, *parts, settings)


def _chosen(case: Case, theory: Theory, effects) -> tuple[Chosen, Check]:
    """Return the model to sample, and the check that it has one natural frequency."""
    linear = build_dynamic(case, dynamic_site_priors(case, theory), theory)
    mode, rival = highest_peak(linear)
    return choose_loss(case, theory, linear, mode, effects), rival


def _specifics(
    problem: DynamicProblem, found: Draws, checks: Sequence[Check]
) -> Specifics:
    """Return what the model of the motion adds to what every calibration has."""
    ratio = problem.priors["damping_ratio"]
    undamped = ratio.family == "fixed" and float(ratio.numbers[0]) == 0.0
    mixed = [name for name in _DERIVED if name != "damping" or not undamped]
    return Specifics(
        log_likelihood=_log_likelihood(problem, found),
        sensitivities=_slopes_in_sds(problem, found),
        mixed={name: found.values[name] for name in mixed},
        checks=[
            *checks,
            whiteness_check(problem, found),
            sampling_rate_check(problem, found),
        ],
        observed=("force", "deformation"),
    )


def _log_likelihood(problem: DynamicProblem, found: Draws) -> dict[str, np.ndarray]:
    """Return the log likelihood by draw and row; nothing if they are many."""
    if found.energy.size * problem.count > MOST_LOG_LIKELIHOODS:
        return {}
    each = np.asarray(_pointwise(problem, found.values))
    return {"deformation": each[..., : problem.count]}


def check_motion(case: Case) -> None:
    """Refuse records that are no time series of one moving gear.

    Raises:
        InputError: with everything that is wrong.
    """
    records, findings = case.records, []

    def find(problem: str, remedy: str) -> None:
        findings.append(Finding(case.name, problem, remedy))

    rows = len(records.force)
    if "time" not in records.known:
        find("no column holds the time", "A moving gear needs one, such as time_s")
    elif len(case.run_labels) > 1 or len(case.specimen_labels) > 1:
        find("holds several runs or gears", "Calibrate one run of one gear at a time")
    elif np.any(np.diff(records.time) <= 0.0):
        row = int(np.argmax(np.diff(records.time) <= 0.0)) + 2
        find(
            f"reading {row} is not later than the one before", "Give each its own time"
        )
    if rows < FEWEST_ROWS:
        find(f"holds {rows} rows of readings", f"At least {FEWEST_ROWS} are needed")
    if np.any(records.force_sd > 0.0):
        find("gives an sd of the force", "The force is taken as exact: leave it out")
    if findings:
        raise InputError(findings)


def highest_peak(problem: DynamicProblem) -> tuple[laplace.Whitening, Check]:
    """Search from every peak of the scan; return the highest, and check the next one.

    Chains start around one peak and never cross to another, so that no R-hat would
    show a second one.
    """
    fits = [laplace.fit(problem, start) for start in scan(problem, _PEAKS)]
    fits = fits or [laplace.fit(problem)]
    level = [float(laplace.potential(problem, fit.centre)) for fit in fits]
    order = np.argsort(level)
    best = fits[order[0]]
    name = "one natural frequency explains the data"
    inverse = np.linalg.inv(best.factor)
    for index in order[1:]:
        apart = [np.ravel(fits[index].centre[n] - best.centre[n]) for n in best.centre]
        if np.linalg.norm(inverse @ np.concatenate(apart)) < _SAME:
            continue
        drop = level[index] - level[order[0]]
        words = f"the next one is {drop:.0f} nat worse, {_RIVAL:g} are needed"
        good = drop >= _RIVAL
        return best, Check(name, "passed" if good else "failed", words)
    return best, Check(name, "passed", "the search from several ends in one place")


@jit
def _pointwise(problem: DynamicProblem, values):
    # Chains side by side, draws one after the other: all at once fill the memory.
    return jax.vmap(partial(jax.lax.map, partial(pointwise, problem)))(values)


def _best_draw(found: Draws) -> dict[str, np.ndarray]:
    """Return the draw of the highest posterior density."""
    place = np.unravel_index(np.argmin(found.potential), found.potential.shape)
    return {name: values[place] for name, values in found.values.items()}


def whiteness_check(problem: DynamicProblem, found: Draws) -> Check:
    """Warn where what is left over is no white noise: intervals are then too narrow."""
    p = noise_probability(problem, _best_draw(found))
    if p >= WHITE:
        return Check(WHITENESS, "passed", f"no correlation over rows (p = {p:.2g})")
    model = "model with dry friction" if problem.effects else "linear model"
    words = (
        "what is left over is correlated from row to row "
        f"(p = {p:.1g}): the {model} does not hold, the intervals are too narrow"
    )
    return Check(WHITENESS, "warning", words)


def sampling_rate_check(problem: DynamicProblem, found: Draws) -> Check:
    """Warn where rows are too far apart for a force that is linear between them."""
    name = "rows follow the vibration"
    frequency = float(np.median(found.values["natural_frequency"]))
    per_period = 1.0 / (
        frequency * float(np.median(np.diff(problem.time[: problem.count])))
    )
    words = f"{per_period:.1f} rows per period of {frequency:.4g} Hz"
    if per_period >= 6.0:
        return Check(name, "passed", words)
    remedy = "the force between rows is guessed as straight; sample faster"
    return Check(name, "warning", f"{words}: {remedy}")


def _slopes_in_sds(problem: DynamicProblem, found: Draws) -> dict[str, np.ndarray]:
    """Return by how much each parameter moves the measured rows, in noise sds."""
    values = _best_draw(found)
    sd = float(values["deformation_sigma"])
    return {name: slope / sd for name, slope in motion_slopes(problem, values).items()}
