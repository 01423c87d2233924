"""Posteriors are calibrated: ranks of the truth are uniform, bands cover.

Simulation-based calibration (Talts et al. 2018): parameters drawn from the prior,
data from the parameters; the rank of the truth among posterior draws is then uniform.
"""

import jax
import numpy as np
import pytest
from rigs import cycles, draw_truth, make_case, make_gear, posterior_draws, simulate
from scipy import stats
from structures import form_of

from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.inference.force_model.problem import build_problem
from hdcal.inference.force_model.values import member_base
from hdcal.physics.chain import predict_reading
from hdcal.physics.registry import EFFECTS

# Draws that the truth is ranked among, thinned so that they are nearly independent.
RANKED, BINS = 99, 10
# False-alarm probability of each uniformity test; the seeds are fixed.
LEVEL = 1e-3
# Runs of a slice: a likelihood that is broken shows in as many.
FEW = 20
COVERAGES = (0.5, 0.9, 0.95)
MODELS = ["base", "rounded", *EFFECTS]


def _setting(model: str):
    effects = (EFFECTS[model],) if model in EFFECTS else ()
    if model == "rounded":
        gear = make_gear(resolution=0.98, noise_correlation=Prior("fixed", (0.0,)))
        return make_case(cycles(), gear), effects
    return make_case(cycles()), effects


def _quantities(values: dict) -> dict:
    """Return what is ranked: every parameter, with the product for the pair."""
    skipped = ("run_", "specimen_", "gap_", "K", "E0", "stiffness")
    named = {n: v for n, v in values.items() if not n.startswith(skipped)}
    return {"K·E0": values["K"] * values["E0"], **named}


def run_sbc(model: str, count: int):
    """Return ranks by quantity, draws by quantity, and hits of the force bands."""
    case, effects = _setting(model)
    form = form_of(case, effects)
    template = build_problem(case, effect_priors(), effects, structure=form)
    ranks, hits = [], []
    for index in range(count):
        key = jax.random.key(1000 + index)
        of_truth, of_data = jax.random.split(key)
        truth = draw_truth(template, of_truth)
        data = simulate(template, case, truth, of_data)
        problem, draws = posterior_draws(
            data, effects, index, form, chains=2, warmup=300, draws=400
        )
        every = len(draws["K"]) // RANKED
        thin = {n: v[::every][:RANKED] for n, v in draws.items()}
        found = {n: v for n, v in _quantities(thin).items() if np.ptp(v) > 0.0}
        true = {n: v for n, v in _quantities(truth).items() if n in found}
        ranks.append({n: int(np.sum(found[n] < true[n])) for n in true})
        hits.append(_band_hits(problem, case, truth, draws))
    return ranks, np.array(hits)


@jax.jit
def _forces(problem, values, row):
    def force(each):
        base = member_base(problem, each)
        return predict_reading(base, (), row, problem.reading)[0][0]

    return jax.vmap(force)(values)


def _band_hits(problem, case, truth, draws) -> list[bool]:
    """Say which central intervals of the force hold the truth, at one row."""
    row = jax.tree.map(lambda column: column[30:31], case.records)
    names = ("K", "E0", "alpha", "deformation_offset", "force_offset", "sigma")
    values = {n: np.append(draws[n], truth[n]) for n in names}
    forces = np.asarray(_forces(problem, values, row))
    below = np.mean(forces[:-1] < forces[-1])
    return [abs(below - 0.5) < level / 2 for level in COVERAGES]


def uniformity(ranks) -> float:
    """Return the p value of a χ² test that ranks 0…RANKED are uniform."""
    counts, _ = np.histogram(ranks, bins=BINS, range=(0, RANKED + 1))
    return float(stats.chisquare(counts).pvalue)


@pytest.mark.parametrize(
    ("model", "count"),
    [
        ("base", FEW),
        pytest.param("progressive_stiffening", FEW, marks=pytest.mark.thorough),
        *(pytest.param(model, 250, marks=pytest.mark.slow) for model in MODELS),
    ],
)
def test_ranks_are_uniform_and_bands_cover(model, count):
    ranks, hits = run_sbc(model, count)
    worst = {name: uniformity([r[name] for r in ranks]) for name in ranks[0]}
    assert min(worst.values()) > LEVEL, worst
    for level, share in zip(COVERAGES, hits.sum(axis=0), strict=True):
        p = stats.binomtest(int(share), len(hits), level).pvalue
        assert p > LEVEL, (level, share / len(hits))
