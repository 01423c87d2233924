"""Calibrate a case: from records and gear to a checked posterior."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

import numpy as np

from hdcal.calibration.known_effects import check_effect_priors, check_names
from hdcal.calibration.straight_line import line_check, straight_check
from hdcal.data.case import Case, Theory, require_case
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors, rig_priors
from hdcal.data.scatter import require_scatter
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, InputError
from hdcal.inference import laplace
from hdcal.inference.checks import correlation_check, rounding_check
from hdcal.inference.force_model.assembly import (
    assemble,
    force_log_likelihood,
    run_settings,
)
from hdcal.inference.force_model.identifiability import linearise
from hdcal.inference.force_model.noise_form import noise_grows, pilot_fit
from hdcal.inference.force_model.priors import problem_priors
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.force_model.structure import decide_structure
from hdcal.inference.force_model.values import MEMBERS
from hdcal.inference.posterior import STRUCTURE, Posterior
from hdcal.inference.sample import Draws, Progress, check_settings, sample
from hdcal.physics.effect import Effect
from hdcal.physics.effects.noise import HeteroscedasticNoise
from hdcal.physics.registry import EFFECTS

# Where readings show that they scatter more at larger forces, it may be by any share.
_SHARE = f"{HeteroscedasticNoise.name}.share"
_GROWING = "wide, because the readings scatter more at larger forces"
_SHOWN = {_SHARE: Prior("half_normal", (0.2,), "1", _GROWING)}
# The constant part is then about this share of what a pilot fit leaves.
_PART, _PART_LOG_SD = 0.3, 0.7
_PART_SOURCE = "the constant part of the residual noise of a preliminary fit"


def choose_effects(
    names: Sequence[str], registry: Mapping[str, type[Effect]] = EFFECTS
) -> tuple[type[Effect], ...]:
    """Look effects up by name in a library; `InputError` if it lacks one."""
    if isinstance(names, str):
        remedy = f"Give a list of names, as ['{names}']"
        raise InputError([Finding("effects", f"'{names}' is not a list", remedy)])
    check_names(names, registry, "effects")
    return tuple(registry[name] for name in dict.fromkeys(names))


def calibrate(
    case: Case,
    *,
    effects: Sequence[str] = (),
    theory: Theory | None = None,
    with_gap: bool | None = None,
    adapt_noise: bool = True,
    chains: int = 4,
    warmup: int = 1000,
    draws: int = 1000,
    seed: int = 0,
    registry: Mapping[str, type[Effect]] = EFFECTS,
    progress: Progress | None = None,
) -> Posterior:
    """Calibrate the force model against a case; the same seed gives the same draws.

    The posterior may have failed its checks, see `Posterior.usable`. Warm-up and draws
    are those of each chain.

    The effects are names of the registry; the theory is by default the gear's. The
    model has a discrepancy, orthogonal to the base model, by `with_gap`, by default
    where the readings show a bend and never with effects. With `adapt_noise`
    the noise grows with the force where it clearly does. `progress` is called with the
    numbers of iterations done and in all.

    Raises:
        InputError: an effect is unknown, has no prior, or lacks its covariates; or
            `case` is none, or nothing tells its noise.
    """
    began = time.perf_counter()
    require_case(case)
    check_settings(chains, warmup, draws, seed)
    requested = choose_effects(effects, registry)
    check_effect_priors(case, registry)
    chosen, shipped = requested, effect_priors(case.gear.full_scale)
    if adapt_noise and _may_grow(case, requested) and noise_grows(case):
        chosen, shipped = (*requested, HeteroscedasticNoise), shipped | _SHOWN
        case = _with_constant_part(case)
    form = decide_structure(case, requested, with_gap)
    theory = theory or case.gear.theory
    priors = problem_priors(case, chosen, shipped, theory)
    problem = build_problem(case, shipped, chosen, theory=theory, structure=form)
    require_scatter(case)
    size = {"chains": chains, "warmup": warmup, "draws": draws}
    mode = laplace.fit(problem)
    found = sample(problem, mode, seed, progress=progress, **size)
    stiffness, records = found.values["stiffness"], case.records
    checks = [
        rounding_check(float(problem.step), problem.rounded, found.values["sigma"]),
        correlation_check(
            found.values, len(records.force), priors, form.why_independent
        ),
    ]
    if not requested and with_gap is None:
        # An effect or a requested discrepancy changes the stiffness.
        checks += [
            line_check(records, stiffness, sized=theory != SPRING),
            straight_check(case, stiffness),
        ]
    say = case.units.say
    parts = assemble(
        case,
        priors,
        problem,
        found,
        seed=seed,
        log_likelihood=force_log_likelihood(case, problem, found),
        sensitivities=linearise(problem, found.median, records).sensitivities(),
        mixed=_other_quantities(problem, found),
        checks=[replace(c, name=say(c.name), words=say(c.words)) for c in checks],
    )
    settings = {"seed": seed, **size, "with_gap": form.with_gap}
    settings |= {STRUCTURE: asdict(form)} | run_settings(found, began)
    return Posterior(case, theory, chosen, priors, *parts, settings)


def _may_grow(case: Case, effects: Sequence[type[Effect]]) -> bool:
    """Return whether it is open how noise goes with the force."""
    stated = case.gear.effect_priors.get(_SHARE)
    fixed = stated is not None and stated.family == "fixed"
    return not fixed and all(effect.stage != "noise" for effect in effects)


def _with_constant_part(case: Case) -> Case:
    """Return a case in which σ is the part of the noise that does not grow.

    Near zero it would make the density discontinuous at the smallest force, where a
    sampler fails. What the gear file states is kept.
    """
    gear, shipped = case.gear, rig_priors()["sigma"]
    if gear.priors["sigma"].source != shipped.source:
        return case
    middle = _PART * pilot_fit(case.records).noise_sd
    believed = Prior("lognormal", (middle, _PART_LOG_SD), "N", _PART_SOURCE)
    return replace(case, gear=replace(gear, priors={**gear.priors, "sigma": believed}))


def _other_quantities(problem: Problem, found: Draws) -> dict[str, np.ndarray]:
    """Return what else must have mixed: the headline, and members that were sampled."""
    others = {"stiffness": found.values["stiffness"]}
    for kind, name in MEMBERS.items():
        if name in found.values and kind not in problem.integrated:
            members = np.moveaxis(found.values[name], -1, 0)
            others |= {f"{name}[{i}]": draws for i, draws in enumerate(members)}
    return others
