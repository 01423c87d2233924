"""`hdcal margin` answers in words, as JSON and as a folder, and refuses in words."""

import json
import re
import shutil
from pathlib import Path

import h5py
import jsonschema
import pytest
from commands import Hdcal
from posteriors import batch, beside, single, stiffer
from schema_checks import obeys

from hdcal.inference.model_average import ModelAverage
from hdcal.prediction.margin.answer import MarginAnswer
from hdcal.report.answer import json_schema

FILES = {"margin.json", "budget.csv", "report.html", "hdcal-result.json"} | {
    f"{name}.{kind}" for name in ("margin", "tornado") for kind in ("svg", "png")
}
ASK = ["--deformation", "0.4"]
NAMES = ("progressive_stiffening", "seating_slack")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result folders: one gear, six gears, and a diagnosis that is not settled."""
    place = tmp_path_factory.mktemp("runs")
    for name in ("one", "six", "ambiguous", "named", "failed"):
        (place / name).mkdir()
    single(size=400).save(place / "one" / "posterior.nc")
    gears = batch(6, 400)
    gears.save(place / "six" / "posterior.nc")
    first, second = NAMES
    models = {first: (0.6, beside(gears, first))}
    models |= {second: (0.4, beside(stiffer(gears, 1.05), second))}
    for name, kept in (("ambiguous", 2), ("named", 1)):
        chosen = dict(list(models.items())[:kept])
        ModelAverage(chosen, None).save(place / name / "posterior.nc")
    failed = {"schema": "hdcal.verdict/3", "status": "failed", "reasons": ["why"]}
    (place / "failed" / "verdict.json").write_text(json.dumps(failed), "utf-8")
    return place


def test_the_folder_is_whole_and_what_json_prints(here: Hdcal, runs: Path, tmp_path):
    asked = ["--limit-force", "120", "--temperature", "-20:80", "--given-force", "80"]
    done = here("margin", runs / "six", *ASK, *asked, "--out", "result", "--json")
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "result"
    assert {path.name for path in folder.iterdir()} == FILES
    found = json.loads((folder / "margin.json").read_text("utf-8"))
    assert json.loads(done.stdout) == found
    obeys(found, MarginAnswer)
    assert found["population"] == "specimens" and found["basis"] == "A-basis"
    # Cold the gear is stiffer; but 60 K from what was tested the rig drifts most.
    assert len(found["levels"]) == 11 and found["worst"]["temperature_C"] == 80.0
    page = (folder / "report.html").read_text("utf-8")
    assert not re.search(r"<script[^>]*src|<link", page)
    refused = here("margin", runs / "six", *ASK, "--out", "result")
    assert refused.returncode == 2 and "exists already" in refused.stderr
    again = here("margin", runs / "one", *ASK, "--out", "result", "--force")
    assert again.returncode == 0


def test_the_schema_misses_every_key_that_is_left_out():
    required = json_schema(MarginAnswer)["required"]
    for key in required:
        with pytest.raises(jsonschema.ValidationError, match=f"'{key}' is a required"):
            obeys({n: 0 for n in required if n != key}, MarginAnswer)


def answered(here: Hdcal, run: Path, *asked: object) -> dict:
    done = here("margin", run, *ASK, *asked, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


# Changes of a true answer that its schema has to refuse, by the key it names.
FALSE = {
    "content": {"content": 1.0},
    "confidence": {"confidence": 0},
    "levels": {"levels": []},
    "basis": {"basis": "C-basis"},
    "population": {"population": "readings"},
    "quantity": {"quantity": "torque"},
    "loading_sense": {"loading_sense": 0},
    "seed": {"seed": -1},
    "status": {"status": "failed"},
    "reasons": {"reasons": ["it is not ok"]},
    "headline": {"headline": ""},
    "interval": {"interval": 0.9},
    "tolerances_mm": {"tolerances_mm": {"radius_mm": -0.1}},
    "remarks": {"remarks": [""]},
    "versions": {"versions": {}},
}


def test_the_schema_refuses_what_no_margin_says(here: Hdcal, runs: Path):
    found = answered(here, runs / "six", "--limit-force", "90", "--given-force", "80")
    obeys(found, MarginAnswer)
    for key, change in FALSE.items():
        with pytest.raises(jsonschema.ValidationError) as refused:
            obeys({**found, **change}, MarginAnswer)
        assert key in refused.value.absolute_path, key
    for place, name in (("force_N", "lo"), ("exceedance", "probability")):
        worst = {**found["worst"], place: {**found["worst"][place], name: None}}
        with pytest.raises(jsonschema.ValidationError):
            obeys({**found, "worst": worst}, MarginAnswer)


@pytest.mark.thorough
def test_an_unsettled_diagnosis_is_averaged_over(here: Hdcal, runs: Path):
    done = here("margin", runs / "ambiguous", *ASK, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [model["probability"] for model in found["models"]] == [0.6, 0.4]
    low, high = (model["upper_bound_N"] for model in found["models"])
    assert low < found["worst"]["upper_bound_N"] < high
    settled = json.loads(here("margin", runs / "named", *ASK, "--json").stdout)
    assert settled["models"] == []


def test_a_failed_diagnosis_gives_no_margin(here: Hdcal, runs: Path):
    done = here("margin", runs / "failed", *ASK)
    assert done.returncode == 1
    assert "this diagnosis failed and must not be used" in done.stderr
    assert done.stdout == ""


def test_a_changed_model_of_a_diagnosis_is_refused(here: Hdcal, runs, tmp_path):
    folder = Path(shutil.copytree(runs / "ambiguous", tmp_path / "run"))
    with h5py.File(folder / "posterior.nc", "r+") as file:
        file["seating_slack/posterior/K"][0, 0] *= 1.01
    done = here("margin", folder, *ASK, "--out", "result", "--json")
    assert done.returncode == 2, done.stderr
    assert json.loads(done.stdout)["status"] == "error"
    assert not (tmp_path / "result").exists()


def test_a_diagnosis_without_models_gives_no_margin(here: Hdcal, runs, tmp_path):
    folder = Path(shutil.copytree(runs / "ambiguous", tmp_path / "run"))
    (folder / "posterior.nc").unlink()
    done = here("margin", folder, *ASK)
    assert done.returncode == 2


BAD = {
    "a missing folder": (["nowhere", *ASK], "nowhere"),
    "limit in mN": (["{one}", *ASK, "--limit-force", "120000"], "Give it in N"),
    "deformation in um": (["{one}", "--deformation", "400"], "Give it in mm"),
    "an empty window": (["{one}", *ASK, "--temperature", "80:-20"], "an empty window"),
    "no window": (["{one}", *ASK, "--temperature", "warm"], "--temperature"),
    "half a window": (["{one}", *ASK, "--temperature", "20:"], "--temperature"),
    "content in %": (["{one}", *ASK, "--content", "99"], "between 0 and 1"),
    "impossible": (["{one}", *ASK, "--required-probability", "1"], "between 0 and 1"),
    "of one gear": (["{one}", *ASK, "--population", "specimens"], "one gear"),
    "no tolerance": (["{one}", *ASK, "--tolerance", "thin"], "is not NAME="),
    "twice": (
        ["{one}", *ASK, *["--tolerance", "radius_mm=0.1"] * 2],
        "is given twice",
    ),
    "no number": (["{one}", "--deformation", "much"], "'much' is no number"),
    "decimal comma": (
        ["{one}", "--deformation", "0,4"],
        "Write it like 0.4 mm, with a decimal point",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_said_and_nothing_is_written(here: Hdcal, runs, tmp_path, name):
    arguments, words = BAD[name]
    given = [text.format(one=runs / "one") for text in arguments]
    done = here("margin", *given, "--out", "result")
    assert done.returncode == 2, done.stderr
    assert words in " ".join(done.stderr.split())
    assert done.stdout == "" and list(tmp_path.iterdir()) == []


def test_everything_bad_on_the_line_is_said_at_once(here: Hdcal, runs: Path):
    asked = ["--temperature", "80:20", "--tolerance", "thin", "--out", "a/b/c"]
    done = here("margin", "nowhere", *ASK, *asked)
    assert done.returncode == 2
    for words in ("--temperature", "--tolerance", "a/b/c", "nowhere"):
        assert words in done.stderr
