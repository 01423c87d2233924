"""Recurrences over rows equal a plain loop and the differential equation."""

import dataclasses

import jax
import numpy as np
import pytest
from scipy import integrate

from hdcal.physics.effect import Rows
from hdcal.physics.effects.loops import CoulombFriction, Hysteresis
from hdcal.physics.effects.stiffness import StiffnessFatigue
from hdcal.physics.effects.time import ChargeLeakage, Relaxation
from hdcal.physics.history import load_cycle, stop_cells

MIXED = np.arange(24).reshape(3, 8).T.ravel()


def slow_cells(deformation, run, reach):
    """Move every cell row by row; a run starts from ω = 0 with all cells at rest."""
    found = np.zeros((len(reach), len(deformation)))
    for label in np.unique(run):
        state, last = np.zeros(len(reach)), 0.0
        for row in np.flatnonzero(run == label):
            for cell, own in enumerate(reach):
                moved = state[cell] + (deformation[row] - last) / own
                state[cell] = min(1.0, max(-1.0, moved))
            last = deformation[row]
            found[:, row] = state
    return found


def slow_cycle(sense, run, specimen):
    """Count rows of the file, specimen by specimen."""
    found, cycle, last, home = [], {}, {}, {}
    for s, r, g in zip(sense, run, specimen, strict=True):
        if r not in home:
            home[r] = s
            cycle[g] = cycle.get(g, 0) + 1
        elif s != last[r] and s == home[r]:
            cycle[g] += 1
        last[r] = s
        found.append(cycle[g])
    return np.array(found)


@pytest.mark.parametrize("mixed", [False, True])
def test_stop_cells(scattered, mixed):
    records, reach = scattered(0), np.array([0.05, 0.3, 2.0])
    order = MIXED if mixed else np.arange(24)
    deformation, run = records.deformation[order], records.run[order]
    found = jax.jit(stop_cells)(deformation, run, reach)
    slow = slow_cells(deformation, run, reach)
    np.testing.assert_allclose(found, slow, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("mixed", [False, True])
def test_load_cycles(scattered, mixed):
    records = scattered(0)
    order = MIXED if mixed else np.arange(24)
    specimen = np.array([0, 1, 0])[records.run]
    if mixed:  # the runs of one gear never take turns
        specimen = records.run
    columns = [c[order] for c in (records.sense, records.run, specimen)]
    found = jax.jit(load_cycle)(*columns)
    np.testing.assert_array_equal(found, slow_cycle(*columns))


def test_a_tenth_cycle_has_lost_one_decade(scattered):
    up_down = np.repeat([1.0, -1.0], 5)
    records = jax.tree.map(lambda leaf: np.resize(leaf, 100), scattered(0))
    records = dataclasses.replace(
        records,
        sense=np.tile(up_down, 10),
        run=np.zeros(100, int),
        specimen=np.zeros(100, int),
    )
    one = np.ones(100)
    rows = Rows(records, 0.0 * one, 200.0 * one, 0.5 * one)
    force = StiffnessFatigue(0.01).apply(100.0 * one, rows)
    np.testing.assert_allclose(force[:10], 100.0)
    np.testing.assert_allclose(force[-10:], 99.0)


def loop(effect, records):
    way = np.concatenate([np.linspace(0, 0.5, 26), np.linspace(0.5, 0, 26)[1:]])
    way = np.concatenate([way, np.linspace(0, 0.5, 26)[1:]])
    sense = np.repeat([1.0, -1.0, 1.0], [26, 25, 25])
    records = jax.tree.map(lambda leaf: np.resize(leaf, len(way)), records)
    records = dataclasses.replace(
        records, deformation=way, sense=sense, run=np.zeros(len(way), int)
    )
    rows = Rows(records, *np.zeros((2, len(way))), way)
    return np.asarray(effect.apply(np.zeros(len(way)), rows))


def test_a_loop_closes_gradually_where_friction_jumps(scattered):
    found = loop(Hysteresis(4.0, 0.1), scattered(0))
    assert found[0] == 0.0
    assert found[25] == pytest.approx(4.0)
    assert found[50] == pytest.approx(-4.0)
    # At rest every cell sticks: slope F_h times the mean of 1/ω_j, twice the way back.
    assert found[1] == pytest.approx(4.0 * 0.02 * np.mean([40.0, 20.0, 40 / 3, 10.0]))
    assert np.flatnonzero(found[:26] < 4.0 - 1e-9)[-1] == 4
    back = 4.0 - found[25:51]
    assert np.all(np.diff(back) >= -1e-12)
    assert np.flatnonzero(back > 8.0 - 1e-9)[0] == 10
    jump = loop(CoulombFriction(4.0), scattered(0))
    assert np.max(np.abs(np.diff(jump))) == 8.0
    assert np.max(np.abs(np.diff(found[25:]))) < 2.0


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


@pytest.mark.parametrize("rate", [1e-9, 1e-3, 3.0])
def test_leakage_obeys_its_differential_equation(scattered, rate):
    """Rows of several runs may alternate in a file; the order within a run counts."""
    records = jax.tree.map(lambda leaf: leaf[MIXED], scattered(4))
    force = records.force
    found, slow = leak(rate, records, force), slow_leak(rate, records, force)
    np.testing.assert_allclose(found, slow, rtol=1e-8, atol=1e-7)
    # What relaxes is the share of the load that has leaked.
    load = 200.0 * records.deformation
    rows = Rows(records, np.zeros(24), np.full(24, 200.0), records.deformation)
    relaxed = Relaxation(0.04, 1.0 / rate).apply(np.zeros(24), rows)
    left = slow_leak(rate, records, load)
    np.testing.assert_allclose(relaxed, -0.04 * (load - left), rtol=1e-7, atol=1e-7)
