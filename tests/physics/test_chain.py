"""The chain, written for whole records, is the obvious sum row by row."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hdcal.physics.chain import (
    Base,
    Reading,
    force,
    linear_coefficients,
    linear_columns,
    predict_reading,
)
from hdcal.physics.effects.contact import SeatingSlack
from hdcal.physics.effects.loops import CoulombFriction
from hdcal.physics.effects.noise import Outliers
from hdcal.physics.effects.stiffness import ProgressiveStiffening
from hdcal.physics.effects.temperature import ThermalZeroDrift
from hdcal.physics.effects.time import ChargeLeakage
from hdcal.physics.theory import THEORIES

SLACK, GAIN, FRICTION, LEAK, DRIFT = 0.021, 0.37, 1.9, 2.3e-3, 0.11
SHARE, RATIO = 0.08, 4.5
EFFECTS = (
    SeatingSlack(SLACK),
    ProgressiveStiffening(GAIN),
    CoulombFriction(FRICTION),
    ChargeLeakage(LEAK),
    ThermalZeroDrift(DRIFT),
    Outliers(SHARE, RATIO),
)
compiled = jax.jit(predict_reading)


def slow_force(base, records, reading, row, *, effects):
    """Return the force on the gear and the rise of temperature of one row."""
    rise = records.temperature[row] - reading.reference_temperature
    stiffness = base.stiffness * (1.0 - base.alpha * rise)
    seen = (records.deformation[row] - base.deformation_offset) * (
        reading.radial_per_read
    )
    if not effects:
        return stiffness * seen, rise
    relative = seen / SLACK
    seen -= SLACK * relative / (1.0 + relative**8) ** 0.125
    corner = 1e-4
    gain = GAIN * (math.hypot(seen, corner) - corner)
    friction = FRICTION * records.sense[row]
    return stiffness * seen * (1.0 + gain) + friction, rise


def slow_reading(base, records, reading, *, effects):
    """The formula of the design, row by row; effects: all six or none."""
    found = []
    shown = before = 0.0
    for row in range(len(records.deformation)):
        level, rise = slow_force(base, records, reading, row, effects=effects)
        if effects:
            first = row == 0 or records.run[row] != records.run[row - 1]
            if first:
                shown = before = 0.0
            span = records.time[row] - (0.0 if first else records.time[row - 1])
            kept = math.exp(-LEAK * span)
            shown = shown * kept + (level - before) * (1.0 - kept) / (LEAK * span)
            before, level = level, shown
            level += DRIFT * rise
        found.append(level + base.force_offset)
    return np.array(found)


def random_base(seed: int) -> Base:
    rng = np.random.default_rng(seed)
    return Base(
        rng.uniform(20.0, 400.0),
        rng.uniform(0.0, 1e-2),
        rng.normal(0.0, 0.05),
        rng.normal(0.0, 5.0),
        rng.uniform(0.1, 2.0),
    )


@pytest.mark.parametrize("per_read", [1.0, 0.5])
@pytest.mark.parametrize("effects", [(), EFFECTS], ids=["bare", "all effects"])
def test_row_by_row(scattered, effects, per_read):
    records, base = scattered(0), random_base(0)
    reading = Reading(per_read, 23.0)
    mean, noise = compiled(base, effects, records, reading)
    slow = slow_reading(base, records, reading, effects=bool(effects))
    np.testing.assert_allclose(mean, slow, rtol=1e-10, atol=1e-10)
    sd = [math.hypot(base.sigma, own) for own in records.force_sd]
    if effects:
        weights = [1.0 - SHARE, SHARE]
        sds = [sd, [RATIO * own for own in sd]]
    else:
        weights, sds = [1.0], [sd]
    np.testing.assert_allclose(np.exp(noise.log_weight), weights, rtol=1e-10)
    np.testing.assert_allclose(noise.sd, sds, rtol=1e-13)


def test_stages_not_their_listing_decide_the_order(scattered, base, reading):
    records = scattered(1)
    mean, noise = compiled(base, EFFECTS, records, reading)
    # Two sensor effects keep their own order; all others sit alone on their stage
    # or add to it.
    moved = [EFFECTS[5], EFFECTS[3], EFFECTS[4], EFFECTS[2], EFFECTS[1], EFFECTS[0]]
    again, noise_again = compiled(base, moved, records, reading)
    np.testing.assert_allclose(again, mean, rtol=1e-13, atol=1e-12)
    np.testing.assert_array_equal(noise_again.sd, noise.sd)


@pytest.mark.parametrize("per_read", [1.0, 0.5])
def test_the_linear_core_is_exact(scattered, per_read):
    records, base = scattered(10), random_base(10)
    reading = Reading(per_read, 31.0)
    columns = linear_columns(records, reading)
    mean = predict_reading(base, (), records, reading)[0]
    np.testing.assert_allclose(
        columns @ linear_coefficients(base, reading), mean, rtol=1e-12, atol=1e-11
    )


@pytest.mark.parametrize("theory", sorted(THEORIES))
def test_the_force_is_the_chain_without_effects(gear, scattered, reading, theory):
    records = scattered(8)
    influence, modulus, alpha, zero, offset = 2.4, 205e3, 4e-4, 0.01, -2.0
    base = Base(influence * THEORIES[theory](gear, modulus), alpha, zero, offset, 1.0)
    found = force(
        gear,
        modulus,
        influence,
        records.deformation,
        theory=theory,
        alpha=alpha,
        temperature_rise=records.temperature - 20.0,
        deformation_offset=zero,
        force_offset=offset,
    )
    mean = predict_reading(base, (), records, reading)[0]
    np.testing.assert_allclose(found, mean, rtol=1e-12, atol=1e-12)
    assert found.dtype == jnp.float64
