"""A second effect that no reading shows is no part of a pair."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import NOISE, rich, simulated

from hdcal.data.priors import effect_priors
from hdcal.diagnosis.model_posterior import posterior_of
from hdcal.evidence.case_evidence import LEAST_SEEN, pair_name
from hdcal.evidence.closed_form import subspace_evidence
from hdcal.evidence.compute_evidence import compute_evidence
from hdcal.evidence.inner_products import common_terms, subspace_products
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.remainder_evidence import beside_effects
from hdcal.evidence.single_evidence import single_evidence
from hdcal.evidence.unseen_effects import with_unseen
from hdcal.physics.registry import EFFECTS

FRICTION = {"coulomb_friction": {"force": 3.0}}
DRIFT = {"thermal_zero_drift": {"slope": 0.03}}
NAMES = ("coulomb_friction", "progressive_stiffening", "thermal_zero_drift")
LIBRARY = {name: EFFECTS[name] for name in (*NAMES, "screw_error", "seating_slack")}


def evidence_of(effects, seed: int):
    found = compute_evidence(
        simulated(rich(), effects, seed=seed), LIBRARY, effect_priors()
    )
    return with_unseen(found, posterior_of(found).inclusion)


def test_beside_a_true_cause_what_is_not_there_is_not_seen():
    """Before, each other effect kept its share; the true one gains what they lose."""
    others, unseen, left = {*LIBRARY} - {"coulomb_friction"}, [], []
    for seed in range(4):
        evidence = evidence_of(FRICTION, seed)
        pairs = {pair_name("coulomb_friction", other) for other in others}
        assert pairs <= {*evidence.unseen}
        unseen += [evidence.unseen[pair]["coulomb_friction"] for pair in pairs]
        chances = posterior_of(evidence).probabilities
        left += [chances[pair] for pair in pairs]
        assert sum(chances.values()) == pytest.approx(1.0)
    assert np.mean(unseen) > 0.8
    # One in twenty would be seen by chance at this size of test.
    assert np.median(left) < 0.005
    assert np.count_nonzero(np.array(left) > 0.05) <= 2


def test_a_second_effect_that_is_there_is_seen():
    both = pair_name("coulomb_friction", "thermal_zero_drift")
    evidence = evidence_of(FRICTION | DRIFT, 0)
    # Each alone is no rival of the pair; were it one, the other would still be seen.
    assert posterior_of(evidence).probabilities[both] > 0.9
    found = with_unseen(evidence, {"coulomb_friction": 1.0}).unseen
    assert found[both]["coulomb_friction"] < 0.01


@pytest.mark.thorough
def test_of_two_lookalikes_either_may_be_the_one_that_is_not_seen():
    """A drift of the zero and an expanding frame: beside each the other is nothing."""
    library = LIBRARY | {"thermal_expansion": EFFECTS["thermal_expansion"]}
    found = compute_evidence(simulated(rich(), DRIFT, seed=4), library, effect_priors())
    chances = posterior_of(found).inclusion
    names = ("thermal_zero_drift", "thermal_expansion")
    assert all(chances[name] > 0.1 for name in names)
    alone = with_unseen(found, chances).unseen[pair_name(*names)]
    assert sum(alone.values()) > 0.8
    share = chances[names[0]] / sum(chances[name] for name in names)
    assert alone[names[0]] / sum(alone.values()) == pytest.approx(share, abs=0.1)


@pytest.mark.parametrize("first", ["quantisation", "heteroscedastic_noise"])
def test_beside_an_effect_on_the_noise_too(first):
    """Nothing acts on the mean: what would is seen beside neither."""
    library = LIBRARY | {first: EFFECTS[first]}
    case = simulated(rich(), seed=6)
    step = 0.5 if first == "quantisation" else 0.0
    if step:
        force = step * np.round(np.asarray(case.records.force) / step)
        case = replace(case, records=replace(case.records, force=force))
    evidence = compute_evidence(case, library, effect_priors())
    found = with_unseen(evidence, {first: 1.0}).unseen
    assert {*found} == {pair_name(first, other) for other in LIBRARY}
    chances = [each[first] for each in found.values()]
    assert np.mean(chances) > 0.7
    # And one that acts is seen.
    loud = compute_evidence(
        simulated(rich(), FRICTION, seed=6), library, effect_priors()
    )
    pair = pair_name(first, "coulomb_friction")
    if pair in loud.table:
        assert with_unseen(loud, {first: 1.0}).unseen[pair][first] < 0.01


def test_shares_are_those_of_drawn_amplitudes():
    """By draws of cells and of amplitudes in them, their curves held against noise."""
    evidence = with_unseen(evidence_of(FRICTION, 1), {"coulomb_friction": 1.0})
    case = beside_effects(evidence, ["coulomb_friction"])
    assert evidence.likeliest_correlation == 0.0
    found = single_evidence(
        case.rows, evidence.piecewise, case.priors["sigma"], tolerant=False
    )
    rng = np.random.default_rng(0)
    for index, name in enumerate(found.names):
        if name == "coulomb_friction":
            continue
        part, effect = found.parts[0].of(index), evidence.piecewise[index]
        weight = np.exp(part.log_evidence[0] - part.log_evidence[0].max())
        cell = rng.choice(len(weight), 4000, p=weight / weight.sum())
        size = np.full(4000, np.nan)
        for _ in range(2000):
            empty = np.isnan(size)
            drawn = rng.normal(part.mean[0, cell], part.sd[0, cell])
            inside = (part.cells.low[cell] < drawn) & (drawn < part.cells.high[cell])
            size[empty & inside] = drawn[empty & inside]
        assert np.isfinite(size).mean() > 0.99
        piece = part.cells.piece[cell] - found.starts[index]
        visible = remove_base(case.rows, effect.shapes)
        # Inner products of what the base leaves are those with the whole curve.
        length = np.einsum("gn,gn->g", visible, effect.shapes)[piece] * size**2
        unseen = np.nanmean(length < LEAST_SEEN * case.noise_sd**2)
        pair = pair_name("coulomb_friction", name)
        found_share = evidence.unseen[pair]["coulomb_friction"]
        assert found_share == pytest.approx(unseen, abs=0.03), name
    assert case.noise_sd == pytest.approx(NOISE, rel=0.3)
    assert {*evidence.subspace_effects} == {"screw_error"}
    pair, drawn = (
        pair_name("coulomb_friction", "screw_error"),
        drawn_screw(case, evidence),
    )
    found_share = evidence.unseen[pair]["coulomb_friction"]
    assert found_share == pytest.approx(drawn, abs=0.05)


def drawn_screw(case, evidence) -> float:
    """Return the share of drawn screw errors beside the friction that are not seen."""
    spaces, rng = evidence.subspaces, np.random.default_rng(1)
    own, noise = spaces.of("screw_error"), case.noise_sd**2
    rows = replace(case.rows, correlations=np.zeros(1))
    target = remove_base(rows, rows.reading[None])[0]
    weights, shares = [], []
    products = subspace_products(rows, spaces.columns[own])
    each = subspace_evidence(
        common_terms(rows),
        products,
        spaces.scale[own],
        spaces.log_weight[own],
        case.priors["sigma"],
    )[0]
    for shape, index in enumerate(own):
        columns = spaces.columns[index]
        columns = columns[np.any(columns != 0.0, axis=1)]
        visible = remove_base(rows, columns)
        gram = visible @ columns.T
        for step, scale in enumerate(spaces.scale[index]):
            precision = gram / noise + np.eye(len(gram)) / scale**2
            cov = np.linalg.inv(precision)
            mean = cov @ (columns @ target) / noise
            drawn = rng.multivariate_normal(mean, cov, 400)
            square = np.einsum("di,ij,dj->d", drawn, gram, drawn)
            weights.append(each[shape, step])
            shares.append(np.mean(square < LEAST_SEEN * noise))
    weight = np.exp(np.array(weights) - np.max(weights))
    return float(np.sum(weight * shares) / np.sum(weight))
