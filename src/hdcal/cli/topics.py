"""`hdcal help`: the documentation in the terminal."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import json_option
from hdcal.errors import Finding, InputError


@command("help", short_help="Show a page of the documentation.")
@click.argument("topic", required=False)
@json_option
@click.pass_obj
def show_topic(console: Console, topic):
    """Show a page of the documentation; without TOPIC list them.

    The effects of the library are topics too: `hdcal help hysteresis`.
    """
    from hdcal.data.findings import did_you_mean
    from hdcal.data.resources import pages

    found = pages()
    if topic is not None and topic not in found:
        remedy = did_you_mean(topic, list(found))
        raise InputError([Finding("topic", f"unknown page '{topic}'", remedy)])
    text = None if topic is None else found[topic].read_text("utf-8")
    if console.json:
        page = {"topic": topic, "text": text}
        console.data({"status": "ok", **(page if topic else {"topics": list(found)})})
    elif text is None:
        width = max(map(len, found))
        for name, page in found.items():
            heading = page.read_text("utf-8").lstrip("# ").partition("\n")[0]
            console.result(f"  {name:{width}}  {heading}")
    else:
        from rich.markdown import Markdown

        console.table(Markdown(text, hyperlinks=False))
    return 0
