"""One result class gives JSON, schema, table, terminal text, page and notebook cell."""

import json
import re
from typing import Literal

import jsonschema
import numpy as np
import pytest
from matplotlib.figure import Figure
from pydantic import ValidationError

from hdcal.report import sentences
from hdcal.report.charts.chart_spec import Chart, Line, Panel
from hdcal.report.item import Draws, Interval, Item, quantity
from hdcal.report.result import Result
from hdcal.report.table_files import columns_csv
from hdcal.report.terminal_text import _Markdown, drawn
from hdcal.report.words import digits, number

HOSTILE = "<img src=x onerror=alert(1)>|*_`a`&amp;\\"
BODY = """\
| name | force |
|---|---:|
{% for row in result.rows %}
| {{ row.name }} | {{ row.force_N | median }} |
{% endfor %}

![Forces](forces "Caption")
"""
PAGE = """\
## Details

Text of {{ part }}.

# Appendix

## Command

{{ command | code }}
"""


class Row(Item):
    """One force."""

    name: str = quantity("result", column="gear")
    force_N: Interval = quantity("force", "N")
    limit: float | None = quantity("limit", "N")


class Forces(Result):
    """Some forces."""

    template = "none"
    table = "rows"

    format: Literal["hdcal.forces/1"] = "hdcal.forces/1"
    rows: tuple[Row, ...]
    draws: Draws

    def make_charts(self):
        line = Line(label=HOSTILE, x=np.arange(3.0), y=np.arange(3.0))
        return {"forces": Chart(panels=[Panel(x="x", y="y", marks=[line])])}


@pytest.fixture(autouse=True)
def template(monkeypatch):
    texts = {"title": "{{ result.rows[0].name }}", "subtitle": "forces", "body": BODY}
    texts |= {"headline": "{{ result.rows[0].name }}\nis a {{ part }}.", "page": PAGE}
    blocks = (f"{{% block {n} %}}{t}{{% endblock %}}" for n, t in texts.items())
    whole = "".join(blocks)

    original = sentences.Environment.get_template

    def get_template(self, name):
        return self.from_string(whole) if name == "none" else original(self, name)

    monkeypatch.setattr(sentences.Environment, "get_template", get_template)


def forces(count: int = 1, name: str = "A", **more) -> Forces:
    force = Interval(median=2.0, lo=1.0, hi=float("nan"))
    rows = tuple(Row(name=name, force_N=force, limit=None) for _ in range(count))
    return Forces(rows=rows, draws=np.zeros(3), **more)


def test_json_obeys_its_schema_and_holds_no_draws():
    found = json.loads(forces().to_json())
    assert list(found)[:5] == ["schema", "status", "reasons", "headline", "next_step"]
    assert found["schema"] == "hdcal.forces/1" and found["headline"] == "A is a gear."
    assert found["rows"] == [
        {"name": "A", "force_N": {"median": 2.0, "lo": 1.0, "hi": None}, "limit": None}
    ]
    assert (
        set(found)
        == set(Forces.json_schema()["required"])
        == {*["schema", "status", "reasons", "headline", "next_step", "rows"]}
    )
    jsonschema.validate(found, Forces.json_schema())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(found | {"rows": [{"name": 1}]}, Forces.json_schema())


def test_fields_are_frozen_and_labelled():
    found = forces()
    with pytest.raises(ValidationError):
        found.rows = ()
    with pytest.raises(ValidationError):
        forces(other=1)
    assert Row.label("force_N") == "force [N]"
    assert Row.label("name") == "result"


def test_the_table_has_the_ends_of_intervals_and_no_empty_column():
    frame = forces(2).to_frame()
    assert list(frame.columns) == ["gear", "force_N", "force_lo", "force_hi"]
    assert frame.force_lo.tolist() == [1.0, 1.0] and frame.force_hi.isna().all()
    assert forces(2).to_datatree()["force_N"].dims == ("row",)


def test_csv_has_no_formula_and_no_broken_row():
    columns = {"=a": ["=1+1", "x\ry,z", None], "n": [1.0, np.nan, 1 / 3]}
    columns["ok"] = [True, False, True]
    text = columns_csv(columns)
    assert text.split("\n") == [
        *["'=a,n,ok", "'=1+1,1,true", '"x\ry,z",,false', ",0.333333333,true", ""]
    ]


def test_texts_from_files_are_shown_as_they_are():
    found = forces(name=HOSTILE)
    assert found.headline == f"{HOSTILE} is a gear."
    assert HOSTILE in found.text()
    shown = "&lt;img src=x onerror=alert(1)&gt;|*_`a`&amp;amp;\\"
    page = found.page(command=f"hdcal {HOSTILE} ``b")
    for text in (page, found._repr_html_()):
        assert f"<td>{shown}</td>" in text
        assert "<img src=x" not in text and "<em>" not in text
    assert f"<code>hdcal {shown} ``b</code>" in page
    assert "</script><img" not in page


def test_only_the_page_has_details_and_figures():
    found = forces(part="part")
    page = found.page()
    assert found.headline == "A is a part." and "Text of part." in page
    assert page.count("<details>") == 2 and "<h2>Appendix</h2>" in page
    assert re.search(r'<figure data-touch><img src="data:[^"]+" alt="Forces">', page)
    for text in (found._repr_html_(), found.text()):
        assert "Details" not in text and "Caption" not in text


def test_a_failed_result_is_marked_everywhere():
    found = forces(reasons=("It diverged <b>.",))
    assert found.to_dict()["status"] == "failed"
    assert repr(found) == "<Forces: FAILED, do not use>"
    page = found.page()
    assert "It diverged &lt;b&gt;." in page and 'class="answer failed-answer"' in page
    # The mark across the figure would not be in an interactive one.
    assert "data-touch" not in page and "<figure>" in page
    assert "FAILED" in found.text() and "is a gear" not in found.text()
    assert "FAILED" in found._repr_html_()
    assert "FAILED" in found.plot(Figure().add_subplot()).get_title()


def test_long_tables_are_cut_except_in_a_browser():
    found = forces(103)
    assert found.text().count("\nA  ") == 100 and "3 more rows" in found.text()
    assert found._repr_html_().count("<td>A</td>") == 100
    assert found.page().count("<td>A</td>") == 103


@pytest.mark.parametrize("long", ["a long name " * 9, "n" * 200])
def test_numbers_stay_whole_in_a_narrow_terminal(long: str):
    found = forces(name=long)
    wide = Interval(median=-12345.6, lo=-12345.7, hi=-12345.5)
    row = found.rows[0].model_copy(update={"force_N": wide})
    assert "-12345.60" in found.model_copy(update={"rows": (row,)}).text(width=40)


@pytest.mark.parametrize(
    ("value", "count", "text"),
    [
        (498.2, 2, "498"),
        (480.0, 2, "480"),
        (99.6, 2, "100"),
        (8.43, 2, "8.4"),
        (0.0412, 2, "0.041"),
        (-12345.6, 3, "-12346"),
        (1234.5, 4, "1234"),
        (2.5e7, 2, "2.5e+07"),
        (np.nan, 2, "nan"),
    ],
)
def test_everyday_numbers_have_no_exponent(value: float, count: int, text: str):
    assert digits(value, count) == text
    assert number(20_660.0) == "20660" and number(209.3).endswith("209.3")


@pytest.mark.parametrize("width", [40, 57, 58, 110])
def test_no_number_of_a_table_is_cut_in_a_narrow_terminal(width: int):
    name, *cells = "probe_with_a_long_name_1", "2.786e+06", "2.648e+06 … 2.947e+06"
    table = f"| part | N/mm | 95 % |\n|---|---:|---:|\n| {name} | {' | '.join(cells)} |"
    lines = drawn([_Markdown(table)], width).splitlines()
    row = next(line for line in lines if cells[0] in line)
    assert cells[1] in row and max(map(len, lines)) <= width
    # A name wraps where it must, and is whole if there is room.
    assert name.startswith(row.split()[0]) and "…" not in row.replace(cells[1], "")
    assert (name in row) == (width >= 58)


@pytest.mark.parametrize(("width", "whole"), [(80, True), (34, True), (33, False)])
def test_a_title_is_on_one_line_if_all_columns_have_room(width: int, whole: bool):
    header, row = "| the effect alone | share of the gap |", "| contact onset | 12 % |"
    text = drawn([_Markdown(f"{header}\n|---|---:|\n{row}")], width)
    assert ("share of the gap" in text) == whole
    assert "contact onset" in text and "12 %" in text
