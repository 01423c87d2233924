"""Every public result shows what matters most of it in a notebook's cell."""

import pytest
import xarray as xr
from diagnosis_cases import judged, rich, simulated
from handmade_fleet import handmade
from matplotlib.figure import Figure
from moving import still_posterior
from posteriors import single

import hdcal
from hdcal.data.resources import datasets_folder
from hdcal.errors import InputError

GEAR = datasets_folder() / "xb1-100-80" / "gear.toml"
NAMES = ["Bands", "Case", "Diagnosis", "Fleet", "Margin", "Posterior", "Response"]


@pytest.fixture(scope="module")
def results():
    posterior = single()
    return {
        "Bands": (hdcal.predict(posterior, [0.2, 0.9]), "tested"),
        "Fleet": (handmade(), "% softer (95 %: "),
        "Margin": (hdcal.margin(posterior, 0.4), "99 %"),
        "Case": (hdcal.read_case(GEAR.parent), "in order"),
        "Posterior": (posterior, "per millimetre as read"),
        "Response": (
            hdcal.respond(still_posterior(), "step", points=21, draws=20),
            "The largest deformation is",
        ),
        "Diagnosis": (
            judged(simulated(rich(), {"hysteresis": {"force": 4.0, "reach": 0.1}})),
            "Hysteresis",
        ),
    }


@pytest.mark.parametrize("name", NAMES)
def test_a_result_is_a_cell_a_line_a_table_and_a_drawing(name: str, results):
    found, words = results[name]
    shown = found._repr_html_()
    assert words in shown and "<html" not in shown and "<script" not in shown
    assert repr(found).startswith(f"<{name}") and len(repr(found)) < 400
    frame = found.to_frame()
    assert len(frame) and not frame.columns.duplicated().any()
    axes = Figure().add_subplot()
    assert found.plot(axes) is axes
    named = axes.get_ylabel() or any(axes.get_yticklabels())
    assert axes.get_xlabel() and named and axes.has_data()
    if name != "Case":
        tree = found.to_datatree()
        assert isinstance(tree, xr.DataTree)
        # Draws of these; their table is a frame alone.
        if name not in {"Fleet", "Posterior"}:
            assert set(frame.columns) == set(tree.to_dataset().data_vars)


def test_pyplot_is_asked_where_no_axes_are_given(results):
    import matplotlib
    from matplotlib import pyplot

    with matplotlib.rc_context({"backend": "agg"}):
        axes = results["Bands"][0].plot()
        assert axes.figure.number in pyplot.get_fignums()
        pyplot.close(axes.figure)


def test_a_verdict_stands_for_its_models(results):
    held = {"none": (1.0, results["Posterior"][0])}
    verdict = results["Diagnosis"][0].model_copy(update={"posteriors": held})
    pairs = list(held.values())
    found = hdcal.predict(verdict, [0.2, 0.4]).to_frame()
    listed = hdcal.predict(pairs, [0.2, 0.4]).to_frame()
    assert found.equals(listed)
    with pytest.raises(InputError, match="a quick diagnosis contains none"):
        hdcal.margin(results["Diagnosis"][0], 0.4)


def test_what_is_no_case_or_model_is_told_so(results):
    case = results["Case"][0]
    frame = case.to_frame()
    for asked in (hdcal.calibrate, hdcal.diagnose, hdcal.fit, hdcal.calibrate_dynamic):
        with pytest.raises(
            InputError, match=r"a DataFrame, not a Case\. Read it first"
        ):
            asked(frame)
    with pytest.raises(InputError, match="Case is not a calibrated model"):
        hdcal.margin(case, 0.4)
    with pytest.raises(InputError, match=r"as \['hysteresis'\]"):
        hdcal.calibrate(case, effects="hysteresis")
