"""A second effect that no reading shows is no part of a pair."""

import numpy as np
import pytest
from diagnosis_cases import NOISE, rich, simulated

from hdcal.data.priors import effect_priors
from hdcal.diagnosis.model_posterior import posterior_of
from hdcal.evidence.case_evidence import LEAST_SEEN, pair_name
from hdcal.evidence.compute_evidence import compute_evidence
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
    return with_unseen(found, posterior_of(found).probabilities)


def test_beside_a_true_cause_what_is_not_there_is_not_seen():
    """Before, each other effect kept its share; the true one gains what they lose."""
    others, unseen, left = {*LIBRARY} - {"coulomb_friction"}, [], []
    for seed in range(6):
        evidence = evidence_of(FRICTION, seed)
        pairs = {pair_name("coulomb_friction", other) for other in others}
        assert {*evidence.unseen} == pairs
        assert {first for first, _ in evidence.unseen.values()} == {"coulomb_friction"}
        unseen += [chance for _, chance in evidence.unseen.values()]
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
    alone = {name: float(name == "coulomb_friction") for name in evidence.table}
    assert with_unseen(evidence, alone).unseen[both][1] < 0.01


def test_shares_are_those_of_drawn_amplitudes():
    """By draws of cells and of amplitudes in them, their curves held against noise."""
    evidence = evidence_of(FRICTION, 1)
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
        assert evidence.unseen[pair][1] == pytest.approx(unseen, abs=0.03), name
    assert case.noise_sd == pytest.approx(NOISE, rel=0.3)
