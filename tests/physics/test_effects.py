"""Every effect is null at null, differentiable, symmetric as declared, composable."""

import dataclasses
import pickle

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_bench import (
    Compiled,
    bare,
    compiled_chain,
    contribution,
    difference,
    everyone,
    noisy,
    null,
    numbers,
    score,
    score_and_slope,
    typical,
)
from jax.flatten_util import ravel_pytree
from slices import slice_of

from hdcal import EFFECTS
from hdcal.inference.padding import repeat_last_row
from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Effect, parameters
from hdcal.physics.effects.scatter import Scatter


@everyone
@pytest.mark.parametrize("seed", slice_of(range(3), [0]))
def test_null_changes_nothing(name, seed, scattered, base, reading):
    found = contribution([null(name)], (), base, scattered(seed), reading)
    assert np.max(np.abs(found)) <= 1e-12


@everyone
def test_at_its_typical_size_it_does_something(name, loading, base, reading):
    records = noisy(loading, base, reading, ())
    found = contribution([typical(name)], (), base, records, reading)
    assert np.max(np.abs(found)) > 1e-3


def rest(loading):
    """Return the loading with the gear never touched."""
    zero = np.zeros(len(loading.deformation))
    return dataclasses.replace(loading, deformation=zero, rate=zero)


@everyone
@pytest.mark.parametrize("size", [null, typical])
@pytest.mark.parametrize("moved", [True, False])
def test_gradients_are_finite(name, size, moved, scattered, base, reading):
    records = noisy(scattered(6) if moved else rest(scattered(6)), base, reading, ())
    found = score_and_slope((size(name),), bare(base), numbers(records), reading)
    assert np.isfinite(ravel_pytree(found)[0]).all()


@everyone
@pytest.mark.parametrize("seed", slice_of(range(2), [0]))
def test_gradients_are_right(name, seed, scattered, base, reading, differences):
    records = scattered(seed)
    mean = compiled_chain(base, (), records, reading)[0]
    # Errors of a few sds: larger ones would drown everything else in the score.
    error = np.random.default_rng(seed).normal(0.0, 1.0, len(mean))
    records = dataclasses.replace(records, force=mean + error)

    def value(point):
        effect, base, deformation = point
        seen = dataclasses.replace(records, deformation=deformation)
        return score((effect,), base, seen, reading)

    point = (typical(name), base, records.deformation)
    slopes = score_and_slope((point[0],), base, numbers(records), reading)[1]
    exact = ravel_pytree((slopes[0][0], slopes[1], slopes[2].deformation))[0]
    slow = differences(value, point, step=2e-4)
    # An entry counts against what its parameter can do in all.
    scale = np.maximum(np.abs(exact), 1e-3 * np.abs(exact).max())
    assert np.max(np.abs(exact - slow) / scale) < 1e-6


@everyone
def test_jit_and_vmap(name, scattered, base, reading):
    records = scattered(3)
    declared = parameters(EFFECTS[name])
    several = [
        typical(name, **{f: p.typical * factor for f, p in declared.items()})
        for factor in (0.5, 1.0, 1.5)
    ]

    def everything(effect):
        mean, noise = predict_reading(base, [effect], records, reading)
        return mean, noise.sd, noise.log_weight

    each = [everything(effect) for effect in several]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *several)
    batch = jax.jit(jax.vmap(everything))(stacked)
    for index, one in enumerate(each):
        for fast, slow in zip(batch, one, strict=True):
            np.testing.assert_allclose(fast[index], slow, rtol=1e-10, atol=1e-11)


@everyone
def test_pytree_round_trip(name):
    effect = typical(name)
    leaves, structure = jax.tree.flatten(effect)
    assert leaves == [about.typical for about in parameters(effect).values()]
    again = jax.tree.unflatten(structure, leaves)
    assert isinstance(again, EFFECTS[name])
    assert eqx.tree_equal(again, effect)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(effect, next(iter(parameters(effect))), 0.0)


@everyone
def test_copies_of_the_last_row_change_nothing_before_them(
    name, scattered, base, reading
):
    """Rows are padded so, that few executables serve data of every size."""
    records = scattered(9)
    rows = len(records.force)
    there, held = (
        compiled_chain(base, (typical(name),), seen, reading)
        for seen in (records, repeat_last_row(records, rows + 8))
    )
    np.testing.assert_allclose(held[0][:rows], there[0], rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(held[1].sd[:, :rows], there[1].sd, rtol=1e-13)
    np.testing.assert_array_equal(held[1].log_weight, there[1].log_weight)


def mirrored(records):
    """Return the records of the same movements in tension."""
    flipped = ("deformation", "direction", "sense", "rate", "force")
    return dataclasses.replace(
        records, **{name: -getattr(records, name) for name in flipped}
    )


@everyone
def test_symmetry_is_as_declared(name, scattered, base, reading):
    effect, base = typical(name), bare(base)
    records = scattered(4)
    if effect.symmetry == "none":
        return
    rows = len(records.deformation)
    there, back = (
        contribution([effect], (), base, seen, reading)
        for seen in (records, mirrored(records))
    )
    sign = {"odd": -1.0, "even": 1.0}[effect.symmetry]
    np.testing.assert_allclose(back[:rows], sign * there[:rows], rtol=1e-9, atol=1e-10)
    # The noise knows no direction.
    np.testing.assert_allclose(back[rows:], there[rows:], rtol=1e-9, atol=1e-10)
    moved = there[rows:] if effect.stage == "noise" else there[:rows]
    assert np.max(np.abs(moved)) > 1e-3


@pytest.mark.thorough
@everyone
def test_any_two_compose(name, scattered, base, reading):
    """Each effect before each of the library."""
    records, first = scattered(7), Compiled(typical(name))
    alone = predict_reading(base, [first], records, reading)
    for size in (typical, null):
        for other in EFFECTS:
            both = [first, Compiled(size(other))]
            pair = predict_reading(base, both, records, reading)
            found = difference(pair, alone, base)
            assert np.isfinite(found).all(), other
            if size is null:
                assert np.max(np.abs(found)) <= 1e-12, other


@pytest.mark.parametrize("size", [null, typical])
def test_the_whole_library_composes(size, scattered, base, reading):
    records = noisy(scattered(8), base, reading, ())
    library = tuple(size(name) for name in EFFECTS)
    found = score_and_slope(library, base, numbers(records), reading)
    assert np.isfinite(ravel_pytree(found)[0]).all()


@pytest.mark.parametrize("groups", [(), ("rig")])
def test_groups_are_a_tuple_of_names(groups):
    with pytest.raises(TypeError, match="Own: groups and needs are tuples"):

        class Own(Effect, stage="force", groups=groups): ...


def test_abstract_effects_have_no_instances():
    with pytest.raises(TypeError, match="abstract"):
        Effect()
    with pytest.raises(TypeError, match="abstract"):
        Scatter()


@everyone
def test_pickled_and_copied(name):
    assert eqx.tree_equal(pickle.loads(pickle.dumps(typical(name))), typical(name))
