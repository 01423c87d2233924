"""The JSON schemas of all answers: a directive that lists them, and their files."""

import json
import pkgutil
from importlib import import_module
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import hdcal
from hdcal.report.result import Result

FOLDER = "schemas"


def answers() -> dict[str, type[Result]]:
    """Return every answer of the package by its format, and its kind if it has one."""
    for module in pkgutil.walk_packages(hdcal.__path__, "hdcal."):
        import_module(module.name)
    waiting, found = [Result], {}
    for answer in waiting:  # grows while it is walked along
        waiting += answer.__subclasses__()
        # A class that inherits its format is no answer by itself.
        if "format" in vars(answer).get("__annotations__", {}):
            fields = answer.json_schema()["properties"]
            stated = [fields.get(key, {}).get("const") for key in ("schema", "kind")]
            name = " ".join(filter(None, stated))
            assert not name or name not in found, f"two answers are called {name}"
            found[name] = answer
    return dict(sorted(found.items()))


def file_name(name: str) -> str:
    """Return the name of a schema's file: hdcal.margin/1 → hdcal.margin-1.json."""
    return f"{name.replace('/', '-').replace(' ', '-')}.json"


class SchemaList(SphinxDirective):
    """List every answer with what it is and the schema that it obeys."""

    def run(self) -> list[nodes.Node]:
        """Return the list."""
        listed = nodes.bullet_list()
        for name, answer in answers().items():
            first = (answer.__doc__ or "").splitlines()[0]
            link = nodes.reference("", name, refuri=f"{FOLDER}/{file_name(name)}")
            words = nodes.paragraph("", "", link, nodes.Text(f": {first}"))
            listed += nodes.list_item("", words)
        return [listed]


def write_schemas(app: Sphinx, error: Exception | None) -> None:
    """Write the schema of every answer beside the pages."""
    if error is not None:
        return
    folder = Path(app.outdir) / FOLDER
    folder.mkdir(exist_ok=True)
    for name, answer in answers().items():
        text = json.dumps(answer.json_schema(), indent=2) + "\n"
        (folder / file_name(name)).write_text(text, "utf-8")


def setup(app: Sphinx) -> dict:
    """Register both with Sphinx."""
    app.add_directive("json-schemas", SchemaList)
    app.connect("build-finished", write_schemas)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
