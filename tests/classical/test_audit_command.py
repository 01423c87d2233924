"""`hdcal audit` prints every claim with its verdict, and writes a page."""

import json
from pathlib import Path

from commands import Hdcal


def test_the_audit_as_words_json_and_page(here: Hdcal, tmp_path: Path):
    out = tmp_path / "audit"
    done = here("audit", "--json", "--out", out)
    found = json.loads(done.stdout)
    assert (found["schema"], found["status"]) == ("hdcal.audit/1", "ok")
    assert {claim["point"] for claim in found["claims"]} == set(range(1, 12))
    assert "do not hold" in done.stderr
    assert json.loads((out / "audit.json").read_text("utf-8")) == found
    page = (out / "report.html").read_text("utf-8")
    assert all(claim["verdict"] in page for claim in found["claims"])
    assert "http://" not in page and "https://" not in page
    names = {"audit.json", "report.html", "hdcal-result.json"}
    assert {entry.name for entry in out.iterdir()} == names
    assert here("audit", "--out", out, "--force").returncode == 0


def test_a_folder_in_the_way_is_refused_before_any_work(here: Hdcal, tmp_path: Path):
    done = here("audit", "--out", tmp_path)
    assert done.returncode == 2
    assert "exists already" in done.stderr and done.stdout == ""
    assert here("audit", "surplus").returncode == 2
