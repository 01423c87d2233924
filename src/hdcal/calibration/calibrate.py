"""Calibrate a case: from records and gear to a checked posterior."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches

import jax
import numpy as np

from hdcal.data.case import Case, Theory
from hdcal.data.priors import effect_priors
from hdcal.errors import Finding, InputError
from hdcal.inference import laplace
from hdcal.inference.checks import (
    Check,
    bound_check,
    conflict_check,
    identification_checks,
    rounding_check,
    sampling_checks,
)
from hdcal.inference.density import (
    MEMBER_SD,
    MEMBERS,
    log_likelihood,
    log_prior,
)
from hdcal.inference.diagnostics import diagnose_parameters, mixing
from hdcal.inference.flat_directions import (
    beside_members,
    dead_parameters,
    flat_directions,
)
from hdcal.inference.linearisation import linearise
from hdcal.inference.posterior import (
    Posterior,
    build_tree,
    versions,
)
from hdcal.inference.prior_draws import draw_priors
from hdcal.inference.problem import Problem, build_problem, problem_priors
from hdcal.inference.sample import Draws, Progress, check_settings, sample
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.registry import EFFECTS
from hdcal.physics.scatter import Scatter


def choose_effects(
    names: Sequence[str], registry: Mapping[str, type[Effect]] = EFFECTS
) -> tuple[type[Effect], ...]:
    """Look effects up by name.

    Args:
        names: of effects; each counts once.
        registry: the library.

    Raises:
        InputError: a name is not in the library; the nearest one is suggested.
    """
    check_names(names, registry, "--effect")
    return tuple(registry[name] for name in dict.fromkeys(names))


def check_names(
    names: Sequence[str], registry: Mapping[str, type[Effect]], option: str
) -> None:
    """Check that effects are in the library.

    Raises:
        InputError: a name is not; the nearest one is suggested.
    """
    findings = []
    for name in names:
        if name not in registry:
            near = get_close_matches(name, registry, n=1)
            hint = f"Did you mean '{near[0]}'? " if near else ""
            findings.append(
                Finding(
                    option,
                    f"no effect is called '{name}'",
                    f"{hint}The library holds: {', '.join(sorted(registry))}",
                )
            )
    if findings:
        raise InputError(findings)


def check_effect_priors(
    case: Case, registry: Mapping[str, type[Effect]] = EFFECTS
) -> None:
    """Check the gear file's priors of effects against the library.

    Raises:
        InputError: an effect or parameter is not in the library, the unit is of
            another kind, or the spread belongs to the model's own members.
    """
    known = {
        f"{name}.{field}": spec.unit
        for name, effect in registry.items()
        for field, spec in parameters(effect).items()
    }
    scatter = {
        f"{name}.sd": MEMBER_SD[effect.members]
        for name, effect in registry.items()
        if issubclass(effect, Scatter)
    }
    findings = []
    for name, prior in case.gear.effect_priors.items():
        if name in scatter:
            problem = "has its prior under another name"
            remedy = f"Give it as {scatter[name]}"
        elif name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"Did you mean '{near[0]}'? " if near else ""
            problem = "is no parameter of an effect in the library"
            remedy = f"{hint}`hdcal effects` lists them"
        elif prior.unit not in ("", known[name]):
            problem = f"has the unit {prior.unit}, not {known[name]}"
            remedy = f"Give it in {known[name]}"
        else:
            continue
        findings.append(Finding("gear file", problem, remedy, column=f"priors.{name}"))
    if findings:
        raise InputError(findings)


def calibrate(
    case: Case,
    *,
    effects: Sequence[str] = (),
    theory: Theory | None = None,
    with_gap: bool = False,
    chains: int = 4,
    warmup: int = 1000,
    draws: int = 1000,
    seed: int = 0,
    registry: Mapping[str, type[Effect]] = EFFECTS,
    progress: Progress | None = None,
) -> Posterior:
    """Calibrate the force model against a case.

    The result depends on the arguments only: the same seed gives the same draws.

    Args:
        case: from `read_case`.
        effects: names of effects to include.
        theory: overrides the gear's theory.
        with_gap: add a leftover discrepancy, orthogonal to the base model.
        chains: independent chains, two or more so that they can be compared.
        warmup: iterations of adaptation per chain.
        draws: draws kept per chain.
        seed: of `jax.random.key`.
        registry: the library in which names are looked up.
        progress: called with (iterations done, iterations in all).

    Returns:
        The posterior; it may have failed its checks, see `Posterior.usable`.

    Raises:
        InputError: an effect is unknown, has no prior, or lacks its covariates.
    """
    check_settings(chains, warmup, draws)
    began = time.perf_counter()
    chosen = choose_effects(effects, registry)
    check_effect_priors(case, registry)
    theory = theory or case.gear.theory
    shipped = effect_priors()
    problem = build_problem(case, shipped, chosen, theory=theory, with_gap=with_gap)
    priors = problem_priors(case, chosen, shipped, theory)
    of_fit, of_draws, of_prior = jax.random.split(jax.random.key(seed), 3)
    whitening = laplace.fit(problem, of_fit)
    found = sample(
        problem,
        whitening,
        of_draws,
        chains=chains,
        warmup=warmup,
        draws=draws,
        progress=progress,
    )
    settings = {
        "seed": seed,
        "chains": chains,
        "warmup": warmup,
        "draws": draws,
        "with_gap": with_gap,
        "target_acceptance": found.target_acceptance,
        "versions": versions(),
    }
    posterior = _assemble(
        case, theory, chosen, priors, problem, found, of_prior, settings
    )
    seconds = round(time.perf_counter() - began, 3)
    return replace(posterior, settings={**settings, "seconds": seconds})


@jax.jit
def _densities(problem: Problem, values):
    def both(one):
        return log_prior(problem, one), log_likelihood(problem, one)

    return jax.vmap(jax.vmap(both))(values)


def _assemble(
    case: Case, theory, effects, priors, problem: Problem, found: Draws, key, settings
) -> Posterior:
    of_prior, of_data = map(np.asarray, _densities(problem, found.values))
    sampled = {
        name: prior
        for name, prior in priors.items()
        if name in found.values and prior.family != "fixed"
    }
    scalars = {name: found.values[name] for name in sampled}
    diagnoses = diagnose_parameters(scalars, sampled, of_prior, of_data)
    tree = build_tree(case, problem, found, draw_priors(sampled, key), of_data)
    checks = (
        *sampling_checks(
            tree["sample_stats"].to_dataset(),
            diagnoses | mixing(_beside_parameters(problem, found)),
        ),
        rounding_check(float(problem.step), problem.rounded, found.values["sigma"]),
        conflict_check(scalars, sampled),
        bound_check(scalars, sampled),
        *_identification(case, problem, found),
    )
    return Posterior(case, theory, effects, priors, tree, diagnoses, checks, settings)


def _identification(case: Case, problem: Problem, found: Draws) -> tuple[Check, ...]:
    centre = {
        name: np.median(values, axis=(0, 1)) for name, values in found.values.items()
    }
    near = linearise(problem, centre, case.records)
    members = near.members / near.sd[:, None]
    slopes = {
        name: beside_members(slope / near.sd, members)
        for name, slope in near.slopes.items()
    }
    dead = dead_parameters(slopes, problem)
    alive = {name: slope for name, slope in slopes.items() if name not in dead}
    return identification_checks(dead, flat_directions(alive, problem))


def _beside_parameters(problem: Problem, found: Draws) -> dict[str, np.ndarray]:
    """Return what else must have mixed: the headline, and members that were sampled."""
    others = {"stiffness": found.values["stiffness"]}
    for kind, name in MEMBERS.items():
        if name in found.values and kind not in problem.integrated:
            each = np.moveaxis(found.values[name], -1, 0)
            others |= {f"{name}[{index}]": draws for index, draws in enumerate(each)}
    return others
