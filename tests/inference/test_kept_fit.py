"""The fit that a calibration began with is kept in its file."""

import jax
import numpy as np
from commands import XB1
from short import SHORT

import hdcal
from hdcal.inference import laplace
from hdcal.prediction.engine.causes import causes_of


def test_the_fit_is_read_and_not_made_again(tmp_path, monkeypatch):
    case = hdcal.read_case(XB1)
    hdcal.calibrate(case, **SHORT).save(tmp_path / "posterior.nc")
    (cause,) = causes_of(hdcal.Posterior.load(tmp_path))
    fitted = laplace.fit(cause.problem)
    monkeypatch.setattr(laplace, "fit", None)
    found = cause.whitening
    assert jax.tree.structure(found) == jax.tree.structure(fitted)
    pairs = zip(jax.tree.leaves(found), jax.tree.leaves(fitted), strict=True)
    assert all(np.array_equal(one, other) for one, other in pairs)
