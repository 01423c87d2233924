"""Densities, structures, fits and checks have the numbers of a reference."""

import os
from collections.abc import Callable
from dataclasses import replace

import jax
import numpy as np
import pytest
from diagnosis_cases import rich, simulated
from posteriors import batch, single, with_discrepancy
from reference import assert_reference
from rigs import cycles, make_records, ramp
from slices import slice_of
from structures import form_of

from hdcal.calibration.calibrate import choose_effects
from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.inference import laplace
from hdcal.inference.checks import (
    CORRELATION,
    bound_check,
    conflict_check,
    correlation_check,
    mixing_checks,
    rounding_check,
)
from hdcal.inference.diagnostics import diagnose_parameters, have_mixed, pareto_shape
from hdcal.inference.force_model.assembly import force_log_likelihood
from hdcal.inference.force_model.identifiability import (
    identification_checks,
    linearise,
)
from hdcal.inference.force_model.noise_form import fit_lines, noise_grows, pilot_fit
from hdcal.inference.force_model.problem import Problem, build_problem
from hdcal.inference.force_model.residuals import residuals
from hdcal.inference.force_model.structure import decide_structure
from hdcal.inference.importance import sample_by_importance
from hdcal.inference.sample import Draws, sample

STANDARD = (-0.7, 0.0, 1.3)
OUTCOMES = ("passed", "note", "warning", "failed")


def runs_of_gears(**gear) -> Case:
    """Return six runs of three gears that were warmed up, with stated noise."""
    rows, run = 12, np.repeat(np.arange(6), 12)
    records = make_records(
        np.tile(np.linspace(0.03, 0.54, rows), 6),
        run=run,
        specimen=run // 2,
        temperature=np.linspace(20.0, 60.0, 6 * rows),
        force_sd=np.full(6 * rows, 0.2),
        known={"run", "runs", "specimen", "specimens", "temperature", "force_sd"},
    )
    return simulated(records, seed=6, **gear)


BEND = {"progressive_stiffening": {"slope": 0.6}}
LOOP = {"hysteresis": {"force": 4.0, "reach": 0.1}}
STATED = {"force_offset": Prior("normal", (0.5, 0.3), "N", "certificate")}
MODELS: dict[str, tuple[Callable[[], Case], tuple[str, ...], bool]] = {
    "line": (lambda: simulated(ramp(), seed=1), (), False),
    "rounded": (lambda: simulated(ramp(30), seed=2, resolution=1.5), (), False),
    "bend": (lambda: simulated(ramp(60), BEND, correlation=0.6, seed=3), (), True),
    "diametral": (lambda: simulated(cycles(), seed=4, reading="diametral"), (), False),
    "gears": (runs_of_gears, (), False),
    "stated": (lambda: runs_of_gears(**STATED), (), True),
    "loop": (lambda: simulated(rich(), LOOP, seed=5), ("hysteresis",), False),
    "mixture": (lambda: simulated(cycles(), seed=7, freedom=3.0), ("outliers",), False),
    "growing": (
        lambda: simulated(cycles(), seed=8, resolution=0.1),
        ("heteroscedastic_noise", "coulomb_friction"),
        False,
    ),
}


def model_of(name: str) -> tuple[Case, Problem]:
    make, effects, with_gap = MODELS[name]
    case, chosen = make(), choose_effects(effects)
    form = form_of(case, chosen, with_gap)
    return case, build_problem(case, effect_priors(), chosen, structure=form)


@pytest.mark.parametrize(
    "name", slice_of(MODELS, MODELS.keys() - {"stated", "mixture"})
)
def test_density_and_its_mode_are_those_of_the_reference(name: str):
    case, problem = model_of(name)
    mode = laplace.fit(problem)
    values = laplace.values_at(problem, mode.centre)
    numbers = {site: np.ravel(value).tolist() for site, value in values.items()}
    # The sign of an eigenvector is arbitrary, the variance of a parameter is not.
    sd = np.sqrt(np.sum(np.square(mode.factor), axis=1))
    numbers["sd"] = sd.tolist()
    density, likelihood, members, one = [], [], [], np.ones(len(sd))
    for step in STANDARD:
        place = laplace.Whitening(mode.centre, np.diag(sd)).position(step * one)
        given = laplace.values_at(problem, place)
        density.append(float(laplace.potential(problem, place)))
        likelihood.append(float(problem.log_likelihood(given)))
        drawn = problem.draw_members(given, jax.random.key(1))
        members += [float(np.sum(np.square(part))) for part in drawn.values()]
    numbers |= {"density": density, "likelihood": likelihood, "members": members}
    near = linearise(problem, values, case.records)
    parts = near.sensitivities()
    numbers |= {f"to {site}": [float(part @ part)] for site, part in parts.items()}
    numbers["scores"] = near.scores.tolist()
    values |= problem.draw_members(values, jax.random.key(2))
    draws = {site: np.asarray(value)[None, None] for site, value in values.items()}
    kept = Draws(draws, {"energy": np.zeros((1, 1))}, 0.8)
    numbers["rows"] = force_log_likelihood(case, problem, kept)["force"][0, 0].tolist()
    given = problem.priors_given(values)
    checks = identification_checks(parts, given)
    numbers["identified"] = [float(OUTCOMES.index(check.outcome)) for check in checks]
    numbers["given"] = [float(n) for n in given["force_offset"].numbers]
    assert_reference(__file__, f"density {name}", numbers, rel=2e-4, abs=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_structures_and_pilot_fits_are_those_of_the_reference(name: str):
    make, effects, _ = MODELS[name]
    case = make()
    form = decide_structure(case, choose_effects(effects))
    numbers = {
        "form": [float(v) for v in (form.rounded, form.with_gap, form.correlated)],
        "grows": [float(noise_grows(case))],
        "pilot": [pilot_fit(case.records).noise_sd, form.noise_sd],
        "fits": [fit_lines(case.records, kind).noise_sd for kind in ("line", "loop")],
    }
    assert_reference(__file__, f"structure {name}", numbers, rel=1e-5)


@pytest.mark.parametrize("make", (single, batch, with_discrepancy))
@pytest.mark.parametrize("shape", ("none", "bend", "growing", "wild", "serial"))
def test_findings_in_residuals_are_those_of_the_reference(make, shape: str):
    posterior = make(size=400)
    records, rng = posterior.case.records, np.random.default_rng(3)
    scaled = np.asarray(records.deformation) / 0.54
    extra = {
        "none": np.zeros(len(scaled)),
        "bend": 3.0 * scaled**2,
        "growing": 5.0 * scaled**2 * rng.normal(size=len(scaled)),
        "wild": 30.0 * (np.arange(len(scaled)) == 17),
        "serial": np.cumsum(rng.normal(0.0, 0.6, len(scaled))),
    }
    changed = replace(records, force=np.asarray(records.force) + extra[shape])
    case = replace(posterior.case, records=changed)
    found = residuals(replace(posterior, case=case))
    both = found.residual, found.standardised
    numbers = {"sd": [float(np.std(values)) for values in both]}
    for each in (*found.structure, *found.noise):
        size = [float(np.log(each.p_value + 1e-30)), each.size_N]
        if np.isfinite(each.error):
            size += [each.coefficient, each.error]
        numbers[each.name] = size
    name = f"residuals {make.__name__} {shape}"
    assert_reference(__file__, name, numbers, rel=1e-4, abs=1e-9)


def test_convergence_and_checks_are_those_of_the_reference():
    rng = np.random.default_rng(9)
    priors = {
        "K": Prior("lognormal", (2.0, 0.4)),
        "force_offset": Prior("normal", (0.0, 1.0)),
        "sigma": Prior("half_normal", (2.0,)),
        CORRELATION: Prior("uniform", (0.0, 1.0)),
    }
    good = {
        "K": np.exp(rng.normal(0.7, 0.05, (4, 500))),
        "force_offset": rng.normal(0.2, 0.6, (4, 500)),
        "sigma": np.abs(rng.normal(0.0, 2.0, (4, 500))),
        CORRELATION: rng.beta(8.0, 8.0, (4, 500)),
    }
    bad = {name: values + 3.0 * np.std(values) for name, values in good.items()}
    bad["K"] = np.cumsum(rng.normal(size=(4, 500)), axis=1) + 9.0
    bad["force_offset"] = good["force_offset"] + 5.0
    numbers: dict[str, list[float]] = {}
    for kind, draws in {"good": good, "bad": bad}.items():
        found = diagnose_parameters(draws, priors)
        for name, one in found.items():
            numbers[f"{kind} {name}"] = [
                one.rhat,
                one.ess_bulk,
                one.ess_tail,
                one.contraction,
                float(one.driven_by == "data"),
            ]
        checks = (
            *mixing_checks(found, 4),
            conflict_check(draws, priors),
            bound_check(draws, priors),
            *(correlation_check(draws, rows, priors) for rows in (8, 60, 2000)),
            *(rounding_check(s, False, draws["sigma"]) for s in (0.1, 2.0, 4.0)),
        )
        numbers[f"{kind} checks"] = [float(OUTCOMES.index(c.outcome)) for c in checks]
        numbers[f"{kind} mixed"] = [float(have_mixed(draws))]
    heavy = rng.pareto(1.2, 4000)
    numbers["shape"] = [pareto_shape(heavy), pareto_shape(good["K"].ravel())]
    assert_reference(__file__, "checks", numbers, rel=1e-4)


@pytest.mark.parametrize("sampler", ("nuts", "importance"))
def test_samplers_find_the_quartiles_of_the_reference(sampler: str):
    """Quartiles, as σ has a long tail; the reference is of 80,000 draws of NUTS."""
    _, problem = model_of("line")
    whitening = laplace.fit(problem)
    draws = 20_000 if os.environ.get("HDCAL_RENEW") == "1" else 2000
    if sampler == "nuts":
        values = sample(problem, whitening, 3, warmup=300, draws=draws).values
    else:
        found = sample_by_importance(problem, whitening, 3, chains=4, draws=draws)
        assert found is not None and found.shape < 0.7
        values = found.values
    numbers = {}
    for name in problem.priors.keys() & values.keys():
        low, middle, high = np.quantile(values[name], [0.25, 0.5, 0.75])
        shift = middle - laplace.values_at(problem, whitening.centre)[name]
        numbers[name] = [float(shift / (high - low)), float(np.log(high - low))]
    # Of 8000 draws a fifth are effective at least: their error is 0.04 at most.
    assert_reference(__file__, "quartiles", numbers, abs=0.12)
