"""Every public result shows what matters most of it in a notebook's cell."""

import inspect
from dataclasses import is_dataclass, replace

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from moving import still_posterior
from posteriors import single
from verdicts import named

import hdcal
from hdcal.data.gear import read_gear
from hdcal.data.resources import datasets_folder
from hdcal.diagnosis.summary import verdict_answer
from hdcal.notebook import TELLERS, Shown

GEAR = datasets_folder() / "xb1-100-80" / "gear.toml"
# What public functions return and is no result.
NO_RESULTS = {"Case", "PolynomialFit", "Residuals"}


def test_every_public_result_is_shown():
    public = [getattr(hdcal, name) for name in hdcal.__all__]
    called = filter(inspect.isfunction, public)
    returned = [inspect.signature(one).return_annotation for one in called]
    results = {c for c in returned if inspect.isclass(c) and is_dataclass(c)}
    assert {c.__name__ for c in results} - NO_RESULTS == set(TELLERS)
    assert all(issubclass(c, Shown) for c in results if c.__name__ not in NO_RESULTS)


@pytest.fixture(scope="module")
def results():
    gear, posterior = read_gear(GEAR), single()
    return {
        "Bands": (hdcal.predict(posterior, [0.2, 0.9]), "extrapolated"),
        "InverseDesign": (
            hdcal.inverse_design(gear, {"radius_mm": (36, 44)}, 90.0, probability=0.5),
            "keeps 90 N",
        ),
        "Margin": (hdcal.margin(posterior, 0.4, sensitivities=False), "99 %"),
        "Posterior": (posterior, "Stiffness at the reference temperature"),
        "Response": (
            hdcal.respond(still_posterior(), "step", points=21, draws=20),
            "The deformation reaches",
        ),
        "Study": (hdcal.study(gear, {"radius_mm": [38, 40]}), "2 designs"),
        "Verdict": (named(), "Most likely cause"),
        "WaveGenerator": (
            hdcal.wave_generator(gear, (0.2, 0.6), probability=0.5),
            "keeps the gear within",
        ),
    }


@pytest.mark.parametrize("name", sorted(set(TELLERS) - {"DynamicPosterior"}))
def test_a_result_is_shown(name: str, results):
    found, words = results[name]
    assert type(found).__name__ == name
    shown = found._repr_html_()
    assert words in shown and "<html" not in shown and "<script" not in shown


def test_a_quick_verdict_says_that_nothing_was_sampled(results):
    quick = replace(results["Verdict"][0], quick=True, seed=3)
    words = "quick: no margins were sampled"
    assert words in quick._repr_html_()
    assert words not in results["Verdict"][0]._repr_html_()
    assert (verdict_answer(quick).seed, verdict_answer(quick).quick) == (3, True)


@pytest.mark.parametrize("name", sorted(set(TELLERS) - {"DynamicPosterior"}))
def test_a_result_is_a_line_a_table_and_a_drawing(name: str, results):
    found, _ = results[name]
    assert repr(found).startswith(f"<{name}") and len(repr(found)) < 400
    frame = found.to_frame()
    assert len(frame) and not frame.columns.duplicated().any()
    axes = Figure().add_subplot()
    assert found.plot(axes) is axes
    assert axes.get_xlabel() and axes.get_ylabel() and axes.has_data()
    tree = found.to_datatree()
    assert isinstance(tree, xr.DataTree)
    if name != "Posterior":
        assert set(frame.columns) == set(tree.to_dataset().data_vars)


def test_tables_hold_what_the_results_say(results):
    margin, verdict = results["Margin"][0], results["Verdict"][0]
    (level,) = margin.to_frame().itertuples()
    assert level.upper_bound_N == margin.worst.upper_bound_N
    assert level.force_N_median == margin.worst.force_N.median
    frame = verdict.to_frame().set_index("hypothesis")
    assert frame.probability.to_dict() == verdict.which.probabilities
    assert frame.probability.is_monotonic_decreasing
    bands, posterior = results["Bands"][0], results["Posterior"][0]
    np.testing.assert_array_equal(bands.to_frame().tested, bands.tested)
    parameters = posterior.to_frame().set_index("name")
    low, middle, high = parameters.loc["K", ["lo", "median", "hi"]]
    assert low < middle < high
    assert posterior.to_datatree() is posterior.tree


def test_pyplot_is_asked_where_no_axes_are_given(results):
    import matplotlib
    from matplotlib import pyplot

    with matplotlib.rc_context({"backend": "agg"}):
        axes = results["Bands"][0].plot()
        assert axes.figure.number in pyplot.get_fignums()
        pyplot.close(axes.figure)


def test_a_failed_result_says_so_in_its_line(results):
    failed = replace(results["Verdict"][0], reasons=("the sampler diverged",))
    assert repr(failed) == "<Verdict: FAILED, do not use>"
