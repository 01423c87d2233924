"""Every example runs as it stands and ends with what it claims."""

import ast
import json
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from slices import slice_of

EXAMPLES = Path(__file__).parents[1] / "examples"

LAST_LINES = {
    "bands_for_a_design.py": "the true forces lie inside the bands",
    "calibrate_a_csv.py": "the least-squares slope lies inside the interval",
    "diagnose_a_gap.py": "without it in the library something outside acts",
    "gradient_of_force.py": "the derivatives agree with finite differences",
    "margin_for_a_design.py": ("the bound holds for the gears that were not measured"),
    "own_effect.py": "the truth lies inside the interval",
}

QUICK = ("calibrate_a_csv.py",)


# In this process, where what one example compiles serves the others.
@pytest.mark.parametrize("name", slice_of(LAST_LINES, QUICK))
def test_an_example_ends_with_its_claim(name: str, tmp_path, capsys, monkeypatch):
    # From another folder: an example finds its data by itself.
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    assert capsys.readouterr().out.splitlines()[-1] == LAST_LINES[name]


def test_an_example_is_a_program_of_its_own(tmp_path: Path):
    name = "gradient_of_force.py"
    done = subprocess.run(
        [sys.executable, "-W", "error", EXAMPLES / name],
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=tmp_path,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == LAST_LINES[name]


def test_every_example_is_run():
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(LAST_LINES)


@pytest.mark.thorough
def test_the_notebook_runs_from_its_first_cell_to_its_last(tmp_path, monkeypatch):
    """In its order, as a notebook runs it: the last line of a cell is shown."""
    import matplotlib
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    written = json.loads((EXAMPLES / "from_a_dataframe.ipynb").read_text("utf-8"))
    cells = [cell for cell in written["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] for cell in cells)
    names: dict[str, object] = {}
    shown: list[object] = []
    with matplotlib.rc_context({"backend": "agg"}):
        for cell in cells:
            *lines, last = ast.parse(cell["source"]).body
            module = ast.Module(lines, [])
            exec(compile(module, "cell", "exec"), names)
            end = ast.unparse(last)
            if isinstance(last, ast.Expr):
                shown.append(eval(end, names))
            else:
                exec(end, names)
        pyplot.close("all")
    assert names["inside"]
    kinds = {type(one).__name__ for one in shown}
    assert kinds == {"DataFrame", "Posterior", "Axes", "Margin", "NoneType"}
    assert "Kraft [N]" in " ".join(names["case"].notes)
