"""`hdcal help`: the documentation in the terminal."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import json_option
from hdcal.errors import Finding, InputError


@command("help", short_help="A page of the documentation, in the terminal.")
@click.argument("topic", required=False)
@json_option
@click.pass_obj
def show_topic(console: Console, topic):
    """Show a page of the documentation; without TOPIC list them.

    The library's effects are topics too, as in `hdcal help hysteresis`.
    """
    from hdcal.data.gear_file.toml_file import did_you_mean
    from hdcal.data.resources import pages

    found = pages()
    if topic is None:
        if console.json:
            console.data({"status": "ok", "topics": list(found)})
            return 0
        width = max(map(len, found))
        for name, page in found.items():
            heading = page.read_text("utf-8").lstrip("# ").partition("\n")[0]
            console.result(f"  {name:{width}}  {heading}")
        return 0
    if topic not in found:
        remedy = did_you_mean(topic, list(found))
        raise InputError([Finding("topic", f"no page is called '{topic}'", remedy)])
    from rich.markdown import Markdown

    text = found[topic].read_text("utf-8")
    if console.json:
        console.data({"status": "ok", "topic": topic, "text": text})
    else:
        console.table(Markdown(text, hyperlinks=False))
    return 0
