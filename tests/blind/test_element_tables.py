"""The tables of the virtual rig are what its finite elements give."""

from functools import cache

import numpy as np
import pytest
from benchmarks.virtual_rig_elements import tables
from benchmarks.virtual_rig_elements.tables import FOLDER, TABLES

from hdcal.blind.virtual_rig.loadings import LOADINGS
from hdcal.blind.virtual_rig.mechanics import FULL, contact_line, large_displacement
from hdcal.blind.virtual_rig.mechanism import RigState


@cache
def recomputed(name: str) -> np.ndarray:
    return TABLES[name][0]()


def assert_agrees(name: str, text: str, expected: np.ndarray) -> None:
    """Every entry agrees; another machine's algebra moves the last digits."""
    head = TABLES[name][1]
    assert text.startswith(head)
    found = np.loadtxt(text.removeprefix(head).splitlines(), delimiter=",")
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=0.0)


@pytest.mark.parametrize("name", TABLES)
def test_a_table_is_recomputed(name: str):
    assert_agrees(name, (FOLDER / name).read_text("utf-8"), recomputed(name))


@pytest.mark.parametrize("name", TABLES)
def test_one_wrong_digit_is_noticed(name: str):
    head, lines = TABLES[name][1], (FOLDER / name).read_text("utf-8").splitlines()
    depth, value = map(float, lines[-1].split(","))
    wrong = [*lines[:-1], f"{depth},{value + 1e-8}"]
    assert "\n".join(wrong).startswith(head)
    with pytest.raises(AssertionError):
        assert_agrees(name, "\n".join(wrong), recomputed(name))


@pytest.mark.parametrize(
    ("name", "size", "changed"),
    [
        ("ring.csv", "RING", tables.RING._replace(elements=20)),
        ("cup.csv", "CUP", tables.CUP._replace(poisson=0.3)),
    ],
)
def test_other_elements_are_noticed(name: str, size: str, changed, monkeypatch):
    monkeypatch.setattr(tables, size, changed)
    with pytest.raises(AssertionError):
        assert_agrees(name, (FOLDER / name).read_text("utf-8"), TABLES[name][0]())


def changed(mechanism, deformation: np.ndarray, size: float, shape) -> np.ndarray:
    """The force after a mechanism over the force before it."""
    force = np.full(deformation.shape, 100.0)
    state = RigState(LOADINGS["ramp"]().history, force, deformation)
    return 1.0 + mechanism(force, state, size, shape) / force


def test_the_mechanisms_go_through_the_tables():
    depth, share = recomputed("ring.csv").T
    found = changed(large_displacement, 40.0 * depth, 1.0 / 40.0, {})
    np.testing.assert_allclose(found, share, rtol=1e-9)
    height, share = recomputed("cup.csv")[:7].T
    moved = (62.0 - height) / 18.0 * FULL
    found = changed(contact_line, moved, 18.0, {"power": 1.0})
    np.testing.assert_allclose(found, share, rtol=1e-9)
