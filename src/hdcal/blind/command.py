"""`hdcal blind`: cases under seal, answers without their truth, and the opening."""

import os
import secrets
from pathlib import Path

import click

from hdcal.cli.command import Command
from hdcal.cli.compilation_cache import keep_compilations, one_thread_for_algebra
from hdcal.cli.console import Console
from hdcal.cli.options import force_option, json_option
from hdcal.errors import Finding, InputError

MOST_CASES = 100_000
# With fewer somebody could draw the cases of every seed and look which ones fit.
_SEED_BITS = 128
_INTERRUPTED = 130


@click.group(short_help="Seal cases, answer them blind, open and score.")
def blind() -> None:
    """Check the diagnosis on cases whose causes it cannot know.

    `make` seals cases and prints a commitment to them, `answer` diagnoses them and
    freezes the answers, `open` verifies both and scores.
    """


@blind.command(short_help="Make a set of sealed cases.")
@click.option("--cases", type=click.IntRange(1, MOST_CASES), help="How many to draw.")
@click.option("--mix", metavar="NAME", help="What to draw them from.")
@click.option(
    "--seed",
    type=click.IntRange(0),
    help="Of the draws; it has to stay secret [default: random].",
)
@click.option(
    "--program",
    metavar="CSV",
    help="Let every case go through what this measurement did [default: the mix's].",
)
@click.option("--from", "source", metavar="CSV", help="Seal a measurement instead.")
@click.option("--gear", metavar="GEAR.toml", help="Its gear file.")
@click.option(
    "--cause",
    metavar="NAME[,NAME]",
    help="What is known to be behind it; 'unknown' for what no library holds.",
)
@click.option(
    "--withhold", metavar="NAME[,NAME]", help="Effects it is answered without."
)
@click.option("--out", metavar="DIR", required=True, help="Set to make.")
@click.option("--key", metavar="FILE", help="Key to write [default: DIR.key].")
@force_option
@json_option
@click.pass_obj
def make(
    console: Console, source, out, key, force, cases, mix, seed, program, **real
) -> int:
    """Seal cases drawn from a mix, or one measurement with a stated cause."""
    one_thread_for_algebra()
    given = {"--cases": cases, "--mix": mix, "--seed": seed, "--program": program}
    _check_forms(source, given, {f"--{name}": text for name, text in real.items()})
    from hdcal.blind.answer import SetAnswer
    from hdcal.blind.sealed_set import check_free, write_set

    key = _beside(out) if key is None else Path(key)
    check_free(out, key, force=force)
    if source is None:
        from hdcal.blind.sealed_measurement import loading_at
        from hdcal.blind.virtual_rig.cases import GEAR_TOML, draw_cases
        from hdcal.blind.virtual_rig.mixes import MIXES
        from hdcal.data.toml_file import nearest

        if mix not in MIXES:
            words, remedy = f"no mix is called '{mix[:60]}'", nearest(mix, list(MIXES))
            raise InputError([Finding("--mix", words, remedy)])
        seed = secrets.randbits(_SEED_BITS) if seed is None else seed
        path = None if program is None else loading_at(program)
        drawn, gear = draw_cases(mix, cases, seed, path), GEAR_TOML
        about = {"mix": mix, "seed": seed}
    else:
        from hdcal.blind.sealed_measurement import sealed_measurement

        table, gear, label = sealed_measurement(source, **real)
        drawn, about = [(table, label)], {}
    manifest = write_set(out, drawn, gear, key, force=force, **about)
    console.result(f"commitment {manifest.commitment}")
    words = f"{len(manifest.cases)} sealed: {out}; keep the key to them: {key}"
    console.words(words)
    if console.json:
        next_step = f"Answer them: hdcal blind answer {out}"
        console.data(_answer(SetAnswer, manifest.plain(), words, next_step))
    return 0


@blind.command(
    cls=Command, short_help="Diagnose every case of a set, and freeze the answers."
)
@click.argument("folder", metavar="DIR")
@click.option(
    "--jobs",
    type=click.IntRange(1, 256),
    default=1,
    show_default=True,
    help="Processes to share the cases.",
)
@click.option(
    "--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers share them."
)
@click.option(
    "--library",
    metavar="minus:NAME[,NAME]",
    help="Leave effects out of every case's library.",
)
@click.option("--by", metavar="NAME", default="hdcal", show_default=True, help="Who.")
@json_option
@click.pass_obj
def answer(console: Console, folder, **settings) -> int:
    """Answer every case of DIR; an interrupted run goes on when it is run again."""
    one_thread_for_algebra()
    keep_compilations()
    from hdcal.blind.answer import FrozenAnswer
    from hdcal.blind.answering import answer_set
    from hdcal.cli.progress import progress_bar

    try:
        with progress_bar("answering") as progress:
            frozen = answer_set(folder, progress=progress, **settings)
    except KeyboardInterrupt:
        words = "what is answered is kept; run the same command again to go on"
        console.words(f"interrupted: {words}")
        return _INTERRUPTED
    console.result(f"answers {frozen['sha256']}")
    words = f"{len(frozen['answers'])} answers by '{frozen['by']}' are frozen"
    console.words(words)
    if not frozen["blind"]:
        console.words("NOT BLIND: this set was opened before")
    if console.json:
        next_step = f"Open it with its key: hdcal blind open {folder} --key FILE"
        console.data(_answer(FrozenAnswer, frozen, words, next_step))
    return 0


@blind.command("open", short_help="Verify everything, decrypt the labels, score.")
@click.argument("folder", metavar="DIR")
@click.option("--key", metavar="FILE", required=True, help="Key of the set.")
@click.option(
    "--by",
    metavar="NAME",
    multiple=True,
    help="Whose answers to score [default: all of them].",
)
@json_option
@click.pass_obj
def open_(console: Console, folder, key, by) -> int:
    """Open DIR, score its frozen answers, and write DIR/result."""
    from hdcal.blind.answer import ScoresAnswer
    from hdcal.blind.document import scores_document
    from hdcal.blind.open import open_set
    from hdcal.report.terminal import terminal_lines

    opening = open_set(folder, Path(key), tuple(dict.fromkeys(by)))
    result = opening.result
    console.result(f"commitment {result['set_commitment']}")
    for name, one in result["answers"].items():
        console.result(f"answers {one['sha256']} by '{name}'")
        if not one["blind"]:
            words = "were frozen after the set was opened"
            console.words(f"NOT BLIND: the answers of '{name}' {words}")
    console.words(f"verified and scored: {opening.folder}")
    document = scores_document(result["scores"], opening.secret.labels, opening.answers)
    if console.json:
        console.data(_answer(ScoresAnswer, result, document.headline, None))
        return 0
    console.table(*terminal_lines(document, str(opening.folder)))
    return 0


def _answer(kind, content: dict, headline: str, next_step: str | None):
    said = {"headline": headline, "next_step": next_step}
    return kind(status="ok", reasons=(), **said, **content)


def _check_forms(source, drawn: dict, real: dict) -> None:
    """Refuse a mixture of the two forms of `make`, or half of one."""
    needed, foreign = ({"--cases", "--mix"}, real)
    given = {**drawn, **real}
    if source is not None:
        needed, foreign = {"--gear", "--cause"}, drawn
    for option in sorted(needed):
        if given[option] is None:
            raise click.UsageError(f"Missing option '{option}'.")
    for option, value in foreign.items():
        if value is not None:
            form = "without" if source is None else "with"
            raise click.UsageError(f"{option} means nothing {form} --from.")


def _beside(out: str) -> Path:
    real = Path(os.path.realpath(out))
    return real.with_name(real.name + ".key")
