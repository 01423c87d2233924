"""Each recipe of CONTRIBUTING, followed in a copy of the tree, works."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

ROOT = Path(__file__).parents[1]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
COPIED = ("src", "priors", "datasets", "docs", "tests")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Return a copy of the tree, free to be changed."""
    ignore = shutil.ignore_patterns("__pycache__", "_build")
    for folder in COPIED:
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=ignore)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def listed(recipe: str, **names: str) -> set[str]:
    """Return the files that a recipe lists, its placeholders filled in."""
    section = CONTRIBUTING.partition(f"### {recipe}\n")[2].partition("\n#")[0]
    found = re.findall(r"^- `([^`]+)`", section, re.MULTILINE)
    for name, value in names.items():
        found = [path.replace(f"<{name}>", value) for path in found]
    return set(found)


def follow(tree: Path, changes: dict[str, str | tuple[str, str]]) -> None:
    """Write new files, and replace a text that is there once by another."""
    for name, change in changes.items():
        path = tree / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(change, str):
            path.write_text(dedent(change).lstrip(), "utf-8")
            continue
        before, old, new = path.read_text("utf-8"), *change
        assert before.count(old) == 1, f"{name}: {old}"
        path.write_text(before.replace(old, new), "utf-8")


def run(tree: Path, *arguments: str) -> str:
    """Run Python on the changed tree; it has to succeed."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree / "src")},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.thorough
def test_an_effect(tree: Path):
    code = '''
        class GreaseCling(
            Effect,
            stage="sensor",
            groups=("zero over temperature",),
            needs=("temperature",),
            symmetry="even",
        ):
            """F → F + g (T − T_ref)².

            Source: made up for this test.
            """

            pull: Scalar = parameter(
                "N/K^2", "pull per squared kelvin", typical=1e-3, null=0.0
            )

            def apply(self, signal: PerRow, rows: Rows) -> PerRow:
                """Return the force with the grease's pull."""
                return signal + self.pull * rows.temperature_rise**2
        '''
    prior = (
        '\n[grease_cling]\npull = { family = "normal", mean = 0.0, sd = 1e-3, '
        'unit = "N/K^2", source = "typical size: made up" }\n\n[force_saturation]'
    )
    page = (ROOT / "docs/effects/thermal_zero_drift.md").read_text("utf-8")
    page = page.replace("thermal_zero_drift", "grease_cling").replace("slope", "pull")
    row = "| [force_saturation](force_saturation.md) | sensor | curvature | – |\n"
    index = (tree / "docs/effects/index.md").read_text("utf-8")
    new_row = "| [grease_cling](grease_cling.md) | sensor | pull | temperature |\n"
    index = index.replace(row, row + new_row)
    index = index.replace("\nforce_saturation\n", "\nforce_saturation\ngrease_cling\n")
    listed_after = "        sensor.ForceSaturation,\n"
    registry = listed_after, listed_after + "        temperature.GreaseCling,\n"
    marker = "class ThermalZeroDrift("
    changes = {
        "src/hdcal/physics/effects/temperature.py": (marker, dedent(code) + marker),
        "src/hdcal/physics/registry.py": registry,
        "priors/effects.toml": ("\n[force_saturation]", prior),
        "docs/effects/grease_cling.md": page,
        "docs/effects/index.md": index,
    }
    assert changes.keys() == listed(
        "An effect", kind="temperature", name="grease_cling"
    )
    follow(tree, changes)
    effects = json.loads(run(tree, "-m", "hdcal", "effects", "--json"))["effects"]
    assert "grease_cling" in [effect["name"] for effect in effects]
    tests = [
        "tests/physics/test_effects.py",
        "tests/physics/test_effect_declarations.py",
    ]
    said = run(tree, "-m", "pytest", "-q", *tests, "-k", "grease_cling")
    assert int(re.findall(r"(\d+) passed", said)[0]) > 10


@pytest.mark.thorough
def test_a_theory(tree: Path):
    function = '''
        def plate(geometry: Geometry, modulus: Scalar) -> Scalar:
            """Return twice the stiffness of the ring.

            Source: made up for this test.
            """
            return 2.0 * ring(geometry, modulus)


        THEORIES: dict[str, Stiffness] = {"plate": plate, '''
    names = (tree / "src/hdcal/data/theory_names.py").read_text("utf-8")
    names = names.replace('Literal["ring"', 'Literal["plate", "ring"')
    names = names.replace(
        '    "ring":', '    "plate": "plate of this test",\n    "ring":'
    )
    changes = {
        "src/hdcal/data/theory_names.py": names,
        "src/hdcal/physics/theory.py": (
            "THEORIES: dict[str, Stiffness] = {",
            dedent(function).lstrip(),
        ),
        "docs/theory.md": ("# Theory\n", "# Theory\n\nThe plate is a plate.\n"),
    }
    assert changes.keys() == listed("A theory")
    follow(tree, changes)
    asked = ["datasets/xb1-100-80", "--theory", "plate", "--json"]
    checked = json.loads(run(tree, "-m", "hdcal", "check", *asked))
    assert checked["gear"]["theory"] == "plate"
    script = (
        "import hdcal; g = hdcal.Geometry(0.68, 40.0, 70.0, 70.0, 0.3);"
        "print(float(hdcal.force(g, 210e3, 1.0, 1.0, theory='plate')))"
    )
    assert float(run(tree, "-c", script)) == pytest.approx(161.81, abs=0.01)


ROOM = {
    "__init__.py": '"""How heavy is the gear?"""\n',
    "weight.py": '''
        """The weight of a gear's wall."""

        import math
        from dataclasses import dataclass

        from hdcal.data.case import Gear


        @dataclass(frozen=True)
        class Weight:
            """Mass of a plain tube [g]."""

            mass: float


        def weight(gear: Gear) -> Weight:
            """Return the mass of the wall as a steel tube."""
            g = gear.geometry
            volume = 2.0 * math.pi * g.radius * g.wall_thickness * g.length
            return Weight(float(volume) * 7.85e-3)
        ''',
    "answer.py": '''
        """What `hdcal weight` answers."""

        from dataclasses import dataclass
        from typing import Literal

        from hdcal.report.answer import Answer


        @dataclass(frozen=True, kw_only=True)
        class WeightAnswer(Answer):
            """What `hdcal weight` answers."""

            schema: Literal["hdcal.weight/1"] = "hdcal.weight/1"
            mass_g: float
        ''',
    "document.py": '''
        """The weight in words."""

        from hdcal.report.document import Document
        from hdcal.weight.answer import WeightAnswer
        from hdcal.weight.weight import Weight


        def weight_answer(found: Weight) -> WeightAnswer:
            """Return the answer for JSON."""
            headline = f"The wall weighs {found.mass:.0f} g."
            return WeightAnswer(
                status="ok",
                reasons=(),
                headline=headline,
                next_step=None,
                mass_g=found.mass,
            )


        def weight_document(answer: WeightAnswer, name: str) -> Document:
            """Return the report."""
            return Document(name, "weight", "mass of the wall", answer.headline)
        ''',
    "command.py": '''
        """`hdcal weight`."""

        import click

        from hdcal.cli.command import command
        from hdcal.cli.console import Console
        from hdcal.cli.options import case_options, json_option, read_given


        @command(short_help="How heavy the wall is.")
        @case_options
        @json_option
        @click.pass_obj
        def weight(console: Console, **given):
            """Say how heavy the wall of the gear of DATA is."""
            with console.wrong:
                case = read_given(console, **given)
            assert case is not None
            from hdcal.weight.document import weight_answer, weight_document
            from hdcal.weight.weight import weight as weigh

            answer = weight_answer(weigh(case.gear))
            document = weight_document(answer, case.gear.name)
            return console.answer(document, answer)
        ''',
}


@pytest.mark.thorough
def test_a_command(tree: Path):
    main = (tree / "src/hdcal/__main__.py").read_text("utf-8")
    main = main.replace(
        "from hdcal.tracking.command import track\n",
        "from hdcal.tracking.command import track\n"
        "from hdcal.weight.command import weight\n",
    ).replace("\n    calibrate,\n", "\n    calibrate,\n    weight,\n")
    changes: dict[str, str | tuple[str, str]] = {
        f"src/hdcal/weight/{name}": text for name, text in ROOM.items()
    }
    changes["src/hdcal/__main__.py"] = main
    changes["pyproject.toml"] = ('    "classical",\n', '    "classical | weight",\n')
    names = {"room": "weight", "question": "weight"}
    assert changes.keys() == listed("A command", **names)
    follow(tree, changes)
    asked = ["-m", "hdcal", "weight", "datasets/xb1-100-80"]
    assert "The wall weighs 94 g." in run(tree, *asked)
    found = json.loads(run(tree, *asked, "--json"))
    assert found["mass_g"] == pytest.approx(93.91, abs=0.01)
    assert "weight" in run(tree, "-m", "hdcal", "--help")
    script = "import sys; from importlinter.cli import lint_imports_command as c; c()"
    run(tree, "-c", script, "--no-cache", "--contract", "rooms")


def test_a_section_of_a_report(tree: Path):
    name = "src/hdcal/classical/audit/document.py"
    text = (tree / name).read_text("utf-8")
    text += dedent(
        """

        def _moral() -> Section:
            return Section("Moral", [Text("Print the data beside the claims.")], True)
        """
    )
    text = text.replace(
        "        sections=[", "        sections=[\n            _moral(),", 1
    )
    assert listed("A section of a report", room="classical/audit") == {name}
    follow(tree, {name: text})
    said = run(tree, "-m", "hdcal", "audit", "--out", "made")
    assert "Moral" in said and "Print the data beside the claims." in said
    page = (tree / "made" / "report.html").read_text("utf-8")
    assert "<summary>Moral</summary>" in page
