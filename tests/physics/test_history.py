"""Recurrences over rows are what a plain loop and the differential equation say."""

import dataclasses

import jax
import numpy as np
import pytest
from scipy import integrate

from hdcal.physics.effect import Rows
from hdcal.physics.effects.time import ChargeLeakage
from hdcal.physics.history import leaky_sum, play


def slow_leaky_sum(decay, gain):
    found, last = [], 0.0
    for keep, more in zip(decay, gain, strict=True):
        last = keep * last + more
        found.append(last)
    return np.array(found)


@jax.jit
def compiled_leak(rate, force, rows):
    return ChargeLeakage(rate).apply(force, rows)


def leak(rate, records, force):
    rows = Rows(records, *np.zeros((3, len(force))))
    return np.asarray(compiled_leak(rate, force, rows))


def slow_leak(rate, records, force):
    """Integrate dF_m/dt = dF/dt − λ F_m along straight lines from reading to reading.

    Every run starts at no force and time 0, whatever rows of others lie between.
    """
    shown = np.zeros(len(force))
    for run in np.unique(records.run):
        state, time, level = 0.0, 0.0, 0.0
        for row in np.flatnonzero(records.run == run):
            span = records.time[row] - time
            if span > 0.0:
                slope = (force[row] - level) / span
                state = integrate.solve_ivp(
                    lambda _, y, slope=slope: slope - rate * y,
                    (0.0, span),
                    [state],
                    rtol=1e-11,
                    atol=1e-11,
                ).y[0, -1]
            else:
                state += force[row] - level
            shown[row] = state
            time, level = records.time[row], force[row]
    return shown


@pytest.mark.parametrize("rows", [1, 2, 3, 17, 256])
def test_leaky_sum(rows):
    rng = np.random.default_rng(rows)
    decay, gain = rng.uniform(0.0, 1.1, rows), rng.normal(size=rows)
    decay[rng.uniform(size=rows) < 0.1] = 0.0
    slow = slow_leaky_sum(decay, gain)
    found = jax.jit(leaky_sum)(decay, gain)
    np.testing.assert_allclose(found, slow, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("rate", [1e-9, 1e-5, 1e-3, 0.1, 3.0])
def test_leakage_obeys_its_differential_equation(scattered, rate):
    records = scattered(4)
    force = records.force
    found, slow = leak(rate, records, force), slow_leak(rate, records, force)
    np.testing.assert_allclose(found, slow, rtol=1e-8, atol=1e-7)


def test_leakage_of_a_held_force(scattered):
    # Documented: at a time constant of 1000 s, 112 N held for 60 s read 6.5 N low.
    hold = jax.tree.map(lambda leaf: leaf[:2], scattered(4))
    hold = dataclasses.replace(hold, time=np.array([0.0, 60.0]))
    shown = leak(1e-3, hold, np.array([112.0, 112.0]))
    assert shown[0] == 112.0
    assert 112.0 - shown[1] == pytest.approx(6.5, abs=0.05)


def test_runs_may_be_interleaved(scattered):
    # Rows of several runs may alternate in a file; the order within a run counts.
    records = scattered(7)
    mixed = np.arange(24).reshape(3, 8).T.ravel()
    shuffled = jax.tree.map(lambda leaf: leaf[mixed], records)
    np.testing.assert_allclose(
        leak(0.02, shuffled, shuffled.force),
        leak(0.02, records, records.force)[mixed],
        rtol=1e-12,
        atol=1e-12,
    )


def slow_play(deformation, half_width, restart):
    found, at = [], 0.0
    for pushed, anew in zip(deformation, restart, strict=True):
        at = 0.0 if anew else at
        if pushed - at > half_width:
            at = pushed - half_width
        elif at - pushed > half_width:
            at = pushed + half_width
        found.append(at)
    return np.array(found)


@pytest.mark.parametrize("rows", [1, 2, 17, 256])
def test_play(rows):
    rng = np.random.default_rng(rows)
    deformation = np.cumsum(rng.normal(0.0, 0.2, rows))
    restart = rng.uniform(size=rows) < 0.05
    found = jax.jit(play)(deformation, 0.3, restart)
    slow = slow_play(deformation, 0.3, restart)
    np.testing.assert_allclose(found, slow, rtol=1e-13, atol=1e-13)


def test_play_counts_turning_points_only():
    # However many rows lie between two turning points, and however long it is held.
    turns = [0.0, 0.5, -0.4, 0.9, 0.2]
    fine = np.interp(np.arange(0.0, 4.01, 0.125), np.arange(5.0), turns)
    held = np.repeat(fine, 3)
    ends = [
        np.asarray(play(path, 0.3, np.zeros(len(path), bool)))[-1]
        for path in (np.array(turns), fine, held)
    ]
    np.testing.assert_allclose(ends, 0.5, rtol=1e-12)
