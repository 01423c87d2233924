"""Every effect of the library keeps the promises of the interface."""

import dataclasses
import pickle

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_bench import (
    BEYOND_RECORDS,
    bare,
    compiled_chain,
    contribution,
    difference,
    every_effect,
    library,
    noisy,
    numbers,
    typical,
)
from jax.flatten_util import ravel_pytree

from hdcal import EFFECTS
from hdcal.data.priors import effect_priors
from hdcal.data.units import to_code
from hdcal.inference.force_model.likelihood import log_probability
from hdcal.inference.force_model.padding import repeat_last_row
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.scatter import Scatter

NAMES = [*EFFECTS]
# How the contribution changes from compression to tension; otherwise its sign does.
UNCHANGED = {
    *("displacement_nonlinearity", "thermal_expansion", "thermal_zero_drift"),
    *("amplifier_drift", "run_offset"),
    *("quantisation", "heteroscedastic_noise", "outliers"),
}
OF_THE_MOVEMENT = {
    *("coulomb_friction", "load_friction", "hysteresis", "viscous_damping"),
    *("screw_error", "large_deflection"),
}


@every_effect
def test_the_declaration_is_complete(name, loading):
    effect, priors = EFFECTS[name], effect_priors()
    assert effect.name == name and effect.family
    assert effect.stage in ("deformation", "force", "sensor", "noise")
    assert effect.needs <= loading.known | BEYOND_RECORDS
    declared = parameters(effect)
    assert declared
    assert list(declared) == [field.name for field in dataclasses.fields(effect)]
    for field, about in declared.items():
        assert 0 < len(about.meaning) <= 80
        assert np.isfinite(about.typical) and about.typical != about.null
        prior = priors[f"{name}.{field}"]
        assert to_code(about.unit) == (1.0, prior.unit) and prior.source


def test_a_declaration_without_family_or_with_a_text_for_needs_is_refused():
    for declared in ({}, {"family": "rig", "needs": "time"}):
        with pytest.raises(TypeError, match="Own"):

            class Own(Effect, stage="force", **declared): ...

    with pytest.raises(TypeError, match="abstract"):
        Effect()
    with pytest.raises(TypeError, match="abstract"):
        Scatter()


@every_effect
def test_it_is_pickled(name):
    effect = typical(name)
    assert eqx.tree_equal(pickle.loads(pickle.dumps(effect)), effect)


def test_null_changes_nothing(scattered, base, reading):
    records = scattered(0)
    chains = [
        compiled_chain(base, effects, records, reading) for effects in (library(), ())
    ]
    assert np.max(np.abs(difference(*chains, base))) <= 1e-12


@every_effect
def test_it_acts_alone_as_among_others(name, loading, base, reading):
    records = noisy(loading, base, reading, ())
    found = contribution([name], base, records, reading)
    assert np.max(np.abs(found)) > 1e-3
    alone = predict_reading(base, (typical(name),), records, reading)
    among = compiled_chain(base, library(name), records, reading)
    assert np.max(np.abs(difference(among, alone, base))) < 1e-9
    # None of the others hides it.
    whole, without = (
        compiled_chain(base, library(*names), records, reading)
        for names in (NAMES, {*NAMES} - {name})
    )
    assert np.max(np.abs(difference(whole, without, base))) > 1e-4


def mirrored(records):
    """Return the records of the same movements in tension."""
    signed = ("deformation", "direction", "sense", "rate", "force")
    return dataclasses.replace(records, **{n: -getattr(records, n) for n in signed})


@pytest.mark.parametrize("name", sorted({*EFFECTS} - OF_THE_MOVEMENT))
def test_tension_is_the_mirror_image_of_compression(name, scattered, base, reading):
    base, records = bare(base), scattered(4)
    rows = len(records.deformation)
    there, back = (
        contribution([name], base, rows, reading)
        for rows in (records, mirrored(records))
    )
    sign = 1.0 if name in UNCHANGED else -1.0
    np.testing.assert_allclose(back[:rows], sign * there[:rows], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(back[rows:], there[rows:], rtol=1e-9, atol=1e-10)
    moved = there[rows:] if EFFECTS[name].stage == "noise" else there[:rows]
    assert np.max(np.abs(moved)) > 1e-3


@every_effect
def test_copies_of_the_last_row_change_nothing_before_them(
    name, scattered, base, reading
):
    """Rows are padded so, that few programs serve data of every size."""
    records = scattered(9)
    rows, effects = len(records.force), library(name)
    there, held = (
        compiled_chain(base, effects, given, reading)
        for given in (records, repeat_last_row(records, rows + 8))
    )
    np.testing.assert_allclose(held[0][:rows], there[0], rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(held[1].sd[:, :rows], there[1].sd, rtol=1e-13)
    np.testing.assert_array_equal(held[1].log_weight, there[1].log_weight)


ROWS = [3, 22, 40, 100, 160]


def together_and_alone(name, base, records, reading):
    """Return readings of some rows among all others, and of each row by itself."""

    def mean(rows):
        return np.asarray(compiled_chain(base, library(name), rows, reading)[0])

    rows = [jax.tree.map(lambda x, i=i: x[i : i + 1], records) for i in ROWS]
    return mean(records)[ROWS], np.concatenate([mean(row) for row in rows])


def test_instantaneous_effects_remember_nothing(base, loading, reading):
    for effect in filter(lambda each: each.instantaneous, EFFECTS.values()):
        whole, alone = together_and_alone(effect.name, base, loading, reading)
        assert alone == pytest.approx(whole, rel=1e-12, abs=1e-12), effect.name
        assert effect.stage in ("deformation", "force")
        # The motion has deformation, speed and temperature; no angle, run or gear.
        assert not effect.needs & {"angle", "time", "cycles", "runs", "specimens"}
    for name in ("relaxation", "hysteresis", "stiffness_fatigue"):
        whole, alone = together_and_alone(name, base, loading, reading)
        assert np.max(np.abs(alone - whole)) > 1e-3


@jax.jit
def score(effects, base, records, reading):
    """Return one number to which every stage contributes."""
    mean, noise = predict_reading(base, effects, records, reading)
    rows = log_probability(records.force, mean, noise, 0.0, rounded=False)
    return jnp.sum(rows) + jnp.vdot(jnp.cos(jnp.arange(len(mean))), mean)


slopes = jax.jit(jax.grad(score, argnums=(0, 1, 2)))


@pytest.mark.parametrize("moved", [True, False])
def test_gradients_are_finite(moved, scattered, base, reading):
    """Also at null, and of a gear that was never touched."""
    records = scattered(6)
    if not moved:
        zero = np.zeros(len(records.deformation))
        records = dataclasses.replace(records, deformation=zero, rate=zero)
    records = numbers(noisy(records, base, reading, ()))
    for names in ((), NAMES, *([name] for name in NAMES)):
        found = slopes(library(*names), bare(base), records, reading)
        assert np.isfinite(ravel_pytree(found)[0]).all(), names


# Covariates that an effect may depend on only if it needs one of these features.
# A memory of time or of unloading starts anew with the run or the specimen.
LICENCES = {
    "temperature": {"temperature"},
    "time": {"time", "holds or rates", "rates", "cycles"},
    "angle": {"angle"},
    "rate": {"rates", "time"},
    "sense": {"unloading", "cycles"},
    "run": {"run", "runs", "time", "cycles", "unloading"},
    "specimen": {"specimen", "specimens", "cycles", "unloading"},
}


def changed(records, what):
    """Return the records with one covariate changed, all else equal."""
    rng = np.random.default_rng(8)
    match what:
        case "time":
            # Still in order within each run, but at another, uneven pace.
            change = {"time": 1.7 * records.time + 0.01 * records.time**2}
        case "sense":
            change = {"sense": -records.sense, "direction": -records.direction}
        case "run" | "specimen":
            rows = len(records.deformation)
            change = {what: np.sort(rng.integers(0, 3, rows))}
        case _:
            column = getattr(records, what)
            change = {what: column + rng.uniform(1.0, 2.0, len(column))}
    return dataclasses.replace(records, **change)


@every_effect
def test_it_depends_on_nothing_that_it_does_not_need(name, loading, base, reading):
    before = contribution([name], bare(base), loading, reading)
    for what, needs in LICENCES.items():
        if not needs & EFFECTS[name].needs:
            given = changed(loading, what)
            after = contribution([name], bare(base), given, reading)
            np.testing.assert_allclose(after, before, atol=1e-9, err_msg=what)
