"""`hdcal predict` answers as a table, as JSON, and says what was not tested."""

import csv
import io
import json
from pathlib import Path

import pytest
from commands import Hdcal
from posteriors import single, with_leftover
from schema_checks import obeys

from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.answer import PredictionAnswer
from hdcal.prediction.bands.bands import predict


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("runs")
    for name, posterior in (("plain", single), ("gap", with_leftover)):
        (place / name).mkdir()
        posterior(size=400).save(place / name / "posterior.nc")
    return place


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_the_table_holds_the_bands(here: Hdcal, runs: Path, tmp_path: Path):
    asked = ["predict", runs / "plain", "--deformation", "0.1:0.5:5"]
    done = here(*asked)
    assert done.returncode == 0, done.stderr
    bands = predict(Posterior.load(runs / "plain"), [0.1, 0.2, 0.3, 0.4, 0.5])
    found = rows(done.stdout)
    assert [row["tested"] for row in found] == ["true"] * 5 and done.stderr == ""
    for name in ("physics_lo_N", "physics_median_N", "new_measurement_hi_N"):
        column = [float(row[name]) for row in found]
        assert column == pytest.approx(getattr(bands, name), rel=1e-8)
    assert here(*asked, "--out", "bands.csv").stdout == ""
    assert (tmp_path / "bands.csv").read_text("utf-8") == done.stdout
    refused = here(*asked, "--out", "bands.csv")
    assert refused.returncode == 2 and "exists already" in refused.stderr
    assert here(*asked, "--out", "bands.csv", "--force").returncode == 0


def test_json_is_the_table_by_column(here: Hdcal, runs: Path):
    for run, gap in (("plain", False), ("gap", True)):
        asked = ["--deformation", "0.2,0.4", "--temperature", "20,60", "--json"]
        done = here("predict", runs / run, *asked)
        found = json.loads(done.stdout)
        obeys(found, PredictionAnswer)
        columns = found["columns"]
        assert columns["deformation_mm"] == [0.2, 0.4, 0.2, 0.4]
        assert (columns["with_gap_median_N"][0] is not None) == gap
        assert columns["tested"] == [True, True, False, False]


def test_all_that_is_wrong_is_said_at_once(here: Hdcal, runs: Path):
    asked = ["--deformation", "x", "--temperature", "warm", "--out", "a/b/c"]
    done = here("predict", runs / "plain", *asked)
    assert done.returncode == 2 and done.stdout == ""
    for words in ("--deformation: 'x'", "--temperature: 'warm'", "a/b/c"):
        assert words in done.stderr


def test_a_decimal_comma_is_no_list_of_deformations(here: Hdcal, runs: Path):
    done = here("predict", runs / "plain", "--deformation=-0,4")
    assert done.returncode == 2 and done.stdout == ""
