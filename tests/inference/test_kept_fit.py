"""The fit that a calibration began with is kept, for who needs its coordinates."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from short import SHORT

import hdcal
from hdcal.inference import laplace
from hdcal.inference.array_tree import ArrayTree
from hdcal.inference.mixed_posterior import mixed_posterior
from hdcal.prediction.engine.causes import causes_of


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> hdcal.Posterior:
    """Return a calibration that was written and read back."""
    case = hdcal.read_case("datasets/xb1-100-80")
    file = tmp_path_factory.mktemp("kept") / "posterior.nc"
    hdcal.calibrate(case, **SHORT).save(file)
    return hdcal.Posterior.load(file)


def whitening(posterior: hdcal.Posterior) -> laplace.Whitening:
    (cause,) = causes_of(posterior)
    return cause.whitening


def with_group(posterior: hdcal.Posterior, **changed) -> hdcal.Posterior:
    """Return a posterior whose kept fit says something else."""
    group = {**posterior.arrays.groups[laplace.GROUP]}
    for name, values in changed.items():
        group[name] = group[name]._replace(values=values)
    groups = {**posterior.arrays.groups, laplace.GROUP: group}
    return replace(posterior, arrays=ArrayTree(groups, posterior.arrays.attrs))


def same(one: laplace.Whitening, other: laplace.Whitening) -> bool:
    return jax.tree.structure(one) == jax.tree.structure(other) and all(
        map(np.array_equal, jax.tree.leaves(one), jax.tree.leaves(other))
    )


def test_it_is_not_searched_for_again(written, monkeypatch):
    fitted = laplace.fit(written.problem)
    monkeypatch.setattr(laplace, "fit", None)
    assert same(whitening(written), fitted)


def test_an_older_file_has_none(written):
    groups = {**written.arrays.groups}
    del groups[laplace.GROUP]
    older = replace(written, arrays=ArrayTree(groups))
    assert same(whitening(older), laplace.fit(written.problem))


@pytest.mark.parametrize(
    "changed",
    [
        {"mode": np.zeros(3)},
        {"mode": np.full(6, np.nan)},
        {"factor": np.eye(5)},
        {"factor": np.full((6, 6), np.inf)},
        {"factor": np.zeros((6, 6))},
        {"mode": np.array(["a"] * 6, dtype=object)},
    ],
)
def test_what_fits_no_such_problem_counts_as_none(written, changed):
    found = whitening(with_group(written, **changed))
    assert same(found, laplace.fit(written.problem))


def test_a_mixture_has_none(written):
    mixed = mixed_posterior({"none": (0.5, written), "unknown": (0.5, written)})
    assert laplace.GROUP not in mixed.arrays.groups
