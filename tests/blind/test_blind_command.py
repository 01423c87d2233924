"""`hdcal blind`: what was sealed is answered as it was, and opened as it was."""

import errno
import json
import shutil
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import sealing
from commands import XB1, Hdcal
from schema_checks import obeys
from sealing import by_library, key_of, sealed_set

from hdcal.blind.answer import FrozenAnswer, ScoresAnswer
from hdcal.blind.answering import answer_set
from hdcal.blind.canonical import with_digest
from hdcal.blind.diagnosers import DIAGNOSERS, fingerprint
from hdcal.blind.label import CaseAnswer
from hdcal.blind.seal import unseal
from hdcal.cli.console import Console
from hdcal.errors import InputError
from hdcal.report.saving import target as target_module

# What every answer says, and the file of frozen answers does not.
NOT_IN_FILE = {"status", "reasons", "headline", "next_step"}

Seen = dict[str, bytes]

pytestmark = pytest.mark.usefixtures("undrawn")


def seen(folder: Path) -> Seen:
    """Return every file below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def change(path: Path, **changed) -> None:
    """Change an object on disk, and stamp it as its writer would."""
    data = json.loads(path.read_text("utf-8"))
    plain = {k: v for k, v in {**data, **changed}.items() if k != "sha256"}
    path.write_text(json.dumps(with_digest(plain)))


@pytest.fixture
def blind(here: Hdcal, monkeypatch: pytest.MonkeyPatch) -> Hdcal:
    """Run `hdcal blind` with a cheap diagnoser."""
    monkeypatch.setitem(DIAGNOSERS, "hdcal", by_library)
    return lambda *arguments: here("blind", *arguments)


@pytest.fixture(scope="session")
def one_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A set and its key, to be copied."""
    return sealed_set(tmp_path_factory.mktemp("made") / "set")


@pytest.fixture(scope="session")
def answered(one_set: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with frozen answers, to be copied."""
    folder = tmp_path_factory.mktemp("answered") / "set"
    copied(one_set, folder)
    answer_set(folder, diagnosers={"hdcal": by_library})
    return folder


def copied(source: Path, target: Path) -> Path:
    """Copy a set and its key."""
    shutil.copytree(source, target)
    shutil.copy(key_of(source), key_of(target))
    return target


@pytest.fixture
def fresh(one_set: Path, tmp_path: Path) -> Path:
    """A set without answers."""
    return copied(one_set, tmp_path / "set")


@pytest.fixture
def frozen(answered: Path, tmp_path: Path) -> Path:
    """A set with frozen answers."""
    return copied(answered, tmp_path / "set")


def refused(done, *words: str) -> None:
    """Check that a command was refused in one line that holds some words."""
    assert done.returncode == 2, done.stderr
    assert not done.stdout
    assert "Traceback" not in done.stderr
    lines = [line for line in done.stderr.splitlines() if line]
    assert len(lines) == 1, done.stderr
    assert all(word in lines[0] for word in words), done.stderr


def test_make_answer_open(blind, tmp_path: Path):
    done = blind("make", "--cases", "3", "--mix", mix(), "--out", "set")
    assert done.returncode == 0, done.stderr
    manifest = json.loads((tmp_path / "set" / "set.json").read_text())
    assert done.stdout == f"commitment {manifest['commitment']}\n"
    assert len(manifest["cases"]) == 3
    key = tmp_path / "set.key"
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    done = blind("answer", "set", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert f"answers {said['sha256']}" in done.stderr
    kept = json.loads((tmp_path / "set" / "answers-hdcal.json").read_text())
    obeys(said, FrozenAnswer)
    assert kept == {k: v for k, v in said.items() if k not in NOT_IN_FILE}
    assert kept["blind"] and kept["set_commitment"] == manifest["commitment"]
    done = blind("open", "set", "--key", "set.key", "--json")
    assert done.returncode == 0, done.stderr
    result = tmp_path / "set" / "result"
    assert {"scores.json", "labels.json"} <= seen(result).keys()
    said = json.loads(done.stdout)
    obeys(said, ScoresAnswer)
    assert said["answers"]["hdcal"] == {"sha256": kept["sha256"], "blind": True}


def mix() -> str:
    """Return the name of some mix."""
    from hdcal.blind.virtual_rig.mixes import MIXES

    return next(iter(MIXES))


def test_the_seed_is_secret_and_draws_the_same_again(blind, tmp_path: Path):
    made = ["make", "--cases", "2", "--mix", mix()]
    for out, seed in (("a", ["--seed", "5"]), ("b", ["--seed", "5"]), ("c", [])):
        assert blind(*made, *seed, "--out", out).returncode == 0
    a, b, c = (seen(tmp_path / out) for out in "abc")
    tables = [name for name in a if name.startswith("cases/")]
    assert all(a[name] == b[name] for name in tables)
    assert all(a[name] != c[name] for name in tables)
    # Salts are new: who knows the seed of one set knows no commitment of the other.
    assert a["set.json"] != b["set.json"] and b'"seed"' not in a["set.json"]


def test_a_measurement_is_sealed_with_its_cause(blind, tmp_path: Path):
    data, gear = XB1 / "data.csv", XB1 / "gear.toml"
    stated = ["--cause", "seating_slack", "--withhold", "hysteresis,outliers"]
    done = blind("make", "--from", data, "--gear", gear, *stated, "--out", "real")
    assert done.returncode == 0, done.stderr
    found = seen(tmp_path / "real")
    assert found["cases/case.csv"] == data.read_bytes()
    assert found["gear.toml"] == gear.read_bytes()
    (entry,) = json.loads(found["set.json"])["cases"]
    assert entry["library"] == "minus:hysteresis,outliers"
    assert not any(b"seating_slack" in content for content in found.values())
    assert blind("answer", "real", "--by", "none").returncode == 0
    assert blind("open", "real", "--key", "real.key").returncode == 0
    (opened,) = json.loads((tmp_path / "real/result/labels.json").read_text())["labels"]
    assert opened["label"]["kind"] == "real"
    assert opened["label"]["truth"] == ["seating_slack"]


def test_an_opening_says_what_was_answered_of_a_measurement(blind):
    given = ["--from", XB1 / "data.csv", "--gear", XB1 / "gear.toml"]
    blind("make", *given, "--cause", "seating_slack", "--out", "real")
    blind("answer", "real", "--by", "none")
    said = " ".join(blind("open", "real", "--key", "real.key").stdout.split())
    assert "none seating slack none no gap > 99 % no" in said
    assert "none on 1 cases (1 measured)" in said
    assert "false alarms" not in said


def test_an_opening_prints_every_row_of_the_bar(blind, fresh: Path):
    assert blind("answer", "set").returncode == 0
    assert blind("answer", "set", "--by", "none").returncode == 0
    done = blind("open", "set", "--key", "set.key")
    said = " ".join(done.stdout.split())
    bar = json.loads((fresh / "result" / "scores.json").read_text())["bar"]
    assert "hdcal on 3 cases (3 without a gap)" in said
    assert "met, not firmly 0.0 % ≤ 5 % 0.0 … 56.1 % 3" in said
    empty = sum(row["value"] is None for row in bar)
    # The headline says it once more.
    assert said.count("no cases") == empty + 1
    met = [sum(row["met"] is word for row in bar) for word in (True, False)]
    assert "{} met, {} missed".format(*met) in said
    again = blind("open", "set", "--key", "set.key", "--json")
    assert json.loads(again.stdout)["status"] == "ok" and "met," not in again.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--mix", "x", "--cases", "2"], "--mix: no mix is called 'x'"),
        (["--mix", "x"], "--cases"),
        (["--cases", "0", "--mix", "x"], "--cases"),
        (["--cases", "2", "--mix", "x", "--cause", "outliers"], "--cause"),
        (["--from", "a.csv", "--cause", "unknown"], "--gear"),
        (["--from", "a.csv", "--gear", "b", "--cause", "x", "--seed", "1"], "--seed"),
        (["--from", XB1 / "data.csv", "--gear", XB1 / "gear.toml"], "--cause"),
    ],
)
def test_half_of_an_order_is_refused(blind, tmp_path: Path, arguments, words: str):
    done = blind("make", *arguments, "--out", "set")
    assert done.returncode == 2 and words in done.stderr
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        (["--cause", "outlier"], "Did you mean 'outliers'?"),
        (["--cause", ","], "names nothing"),
        (["--cause", "unknown,outliers"], "no effect is called 'unknown'"),
        (["--cause", "unknown", "--withhold", "x"], "--withhold: no effect"),
        (["--cause", "outliers", "--withhold", "outliers"], "is withheld"),
    ],
)
def test_a_cause_without_meaning_is_refused(blind, tmp_path: Path, stated, words: str):
    given = ["--from", XB1 / "data.csv", "--gear", XB1 / "gear.toml", *stated]
    refused(blind("make", *given, "--out", "set"), words)
    assert not any(tmp_path.iterdir())


def test_no_key_is_ever_replaced(blind, tmp_path: Path):
    made = ["make", "--cases", "2", "--mix", mix(), "--out", "set"]
    (tmp_path / "set.key").write_text("precious")
    refused(blind(*made), "set.key", "exists already", "--key")
    refused(blind(*made, "--force"), "set.key", "exists already")
    refused(blind(*made, "--key", "no/key"), "no/key", "parent folder")
    refused(blind(*made, "--key", "set/key"), "inside the set")
    assert seen(tmp_path) == {"set.key": b"precious"}


def test_force_replaces_only_an_intact_set_without_answers(
    blind, fresh: Path, tmp_path: Path
):
    made = ["make", "--cases", "2", "--mix", mix(), "--out", "set", "--key", "new"]
    before = seen(tmp_path)
    refused(blind(*made), "exists already")
    assert seen(tmp_path) == before
    assert blind(*made, "--force").returncode == 0
    assert seen(tmp_path)["set.key"] == before["set.key"]
    assert seen(fresh).keys() != before.keys()
    assert blind("answer", "set", "--by", "none").returncode == 0
    made[-1] = "third"
    before = seen(tmp_path)
    refused(blind(*made, "--force"), "'answers-none'")
    shutil.rmtree(fresh / "answers-none")
    (fresh / "answers-none.json").unlink()
    (fresh / "cases" / "mine.csv").write_text("years of work")
    refused(blind(*made, "--force"), "which hdcal did not write")
    assert (fresh / "cases" / "mine.csv").exists() and not (tmp_path / "third").exists()


def test_a_set_that_fails_leaves_neither_folder_nor_key(
    blind, monkeypatch, tmp_path: Path
):
    def broken(*_) -> Iterator:
        yield from sealing.drawn(1)
        raise ZeroDivisionError

    monkeypatch.setattr("hdcal.blind.virtual_rig.cases.draw_cases", broken)
    done = blind("make", "--cases", "2", "--mix", mix(), "--out", "set")
    assert done.returncode == 1 and "ZeroDivisionError" in done.stderr
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize("kind", [KeyboardInterrupt, OSError])
def test_a_set_that_has_its_name_keeps_its_key(
    older: bool, kind: type[BaseException], blind, monkeypatch, tmp_path: Path
):
    error = kind(errno.EIO, "EIO")
    made = ["make", "--cases", "1", "--mix", mix(), "--out", "set", "--force"]
    if older:
        assert blind(*made, "--key", "older").returncode == 0
    before, sync = seen(tmp_path), target_module.sync

    def refused_sync(path: Path) -> None:
        there = path / "set" / "sealed.bin"
        former = before.get("set/sealed.bin")
        if path == tmp_path and there.exists() and there.read_bytes() != former:
            raise error
        sync(path)

    monkeypatch.setattr(target_module, "sync", refused_sync)
    done = blind(*made)
    if kind is KeyboardInterrupt:
        words = f"hdcal: interrupted: {tmp_path}/set.key is written; set is written"
        assert (done.returncode, done.stderr.strip()) == (130, words)
    else:
        assert done.returncode == 1 and "set: is written, but" in done.stderr
    sealed = (tmp_path / "set" / "sealed.bin").read_bytes()
    assert unseal(sealed, (tmp_path / "set.key").read_bytes().strip()).labels
    there = {"set", "set.key", "older"} if older else {"set", "set.key"}
    assert {path.name for path in tmp_path.iterdir()} == there


def test_an_interruption_before_the_set_has_its_name_leaves_no_key(
    blind, monkeypatch, tmp_path: Path
):
    def interrupted(*_) -> None:
        assert (tmp_path / "set.key").exists()
        raise KeyboardInterrupt

    monkeypatch.setattr(target_module, "seal", interrupted)
    done = blind("make", "--cases", "1", "--mix", mix(), "--out", "set")
    assert done.returncode == 130
    assert done.stderr.strip() == "hdcal: interrupted: nothing was written"
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["make", "open"])
def test_an_interruption_of_the_last_words_says_what_is_written(
    command: str, blind, frozen: Path, monkeypatch
):
    def interrupted(*_) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Console, "result", interrupted)
    if command == "make":
        shutil.rmtree(frozen)
        key_of(frozen).unlink()
        done = blind("make", "--cases", "1", "--mix", mix(), "--out", "set")
        assert done.stderr.strip() == "hdcal: interrupted: set is written"
    else:
        done = blind("open", "set", "--key", "set.key")
        assert done.stderr.strip() == "hdcal: interrupted: set/result is written"
    assert done.returncode == 130


def test_an_interrupted_opening_says_that_it_is_recorded(
    blind, frozen: Path, monkeypatch
):
    def interrupted(*_) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("hdcal.blind.open.write_report", interrupted)
    done = blind("open", "set", "--key", "set.key")
    assert done.stderr.strip() == "hdcal: interrupted: set/opened.json is written"
    assert (frozen / "opened.json").exists() and not (frozen / "result").exists()


@pytest.mark.parametrize("both", [False, True])
def test_a_key_whose_place_is_taken_goes_beside_with_its_set(
    both: bool, blind, monkeypatch, tmp_path: Path
):
    def taking(*_) -> Iterator:
        (tmp_path / "set.key").write_text("mine")
        if both:
            (tmp_path / "set").mkdir()
        yield from sealing.drawn(1)

    monkeypatch.setattr("hdcal.blind.virtual_rig.cases.draw_cases", taking)
    done = blind("make", "--cases", "1", "--mix", mix(), "--out", "set")
    assert done.returncode == 2 and "lies beside it, in 'set-2.key'" in done.stderr
    assert ("lies beside it, in 'set-2'" in done.stderr) == both
    there = tmp_path / ("set-2" if both else "set")
    secret = (tmp_path / "set-2.key").read_bytes().strip()
    assert unseal((there / "sealed.bin").read_bytes(), secret).labels
    assert (tmp_path / "set.key").read_text() == "mine"
    names = {"set", "set.key", "set-2.key", there.name}
    assert {path.name for path in tmp_path.iterdir()} == names


def test_a_key_beside_its_place_goes_with_a_set_that_fails(
    blind, monkeypatch, tmp_path: Path
):
    def taking(*_) -> Iterator:
        (tmp_path / "set.key").write_text("mine")
        yield from sealing.drawn(1)

    def interrupted(*_) -> None:
        assert (tmp_path / "set-2.key").exists()
        raise KeyboardInterrupt

    monkeypatch.setattr("hdcal.blind.virtual_rig.cases.draw_cases", taking)
    monkeypatch.setattr(target_module, "seal", interrupted)
    done = blind("make", "--cases", "1", "--mix", mix(), "--out", "set")
    assert done.returncode == 130
    assert seen(tmp_path) == {"set.key": b"mine"}


def test_every_case_is_answered_with_its_own_library(fresh: Path):
    data = answer_set(fresh, diagnosers={"a": by_library}, by="a")
    libraries = {one["case"]: one["probabilities"] for one in data["answers"]}
    assert "hysteresis" in libraries["c01"] and "hysteresis" not in libraries["c02"]
    assert "outliers" in libraries["c02"]
    first = [one["noise_sd"] for one in data["answers"]]
    assert len(set(first)) == 3


def test_a_library_can_be_withheld_from_every_case(blind, fresh: Path):
    asked = ["answer", "set", "--library", "minus:outliers,ovality", "--json"]
    said = json.loads(blind(*asked).stdout)
    withheld = [
        {"hysteresis", "outliers", "ovality"} - one["probabilities"].keys()
        for one in said["answers"]
    ]
    assert [len(gone) for gone in withheld] == [2, 3, 2]
    assert said["library"] == "minus:outliers,ovality"
    assert said["fingerprint"] != fingerprint()
    refused(blind("answer", "set", "--library", "minus:x"), "no effect is called 'x'")


def test_an_interrupted_run_goes_on_where_it_stopped(
    blind, monkeypatch, fresh: Path, tmp_path: Path
):
    answered_cases: list[str] = []

    def interrupted(case, library) -> CaseAnswer:
        if len(answered_cases) == 2 and case.name not in answered_cases:
            answered_cases.append("interrupted")
            raise KeyboardInterrupt
        answered_cases.append(case.name)
        return by_library(case, library)

    monkeypatch.setitem(DIAGNOSERS, "hdcal", interrupted)
    done = blind("answer", "set")
    assert done.returncode == 130
    assert "run the same command again" in done.stderr
    assert seen(fresh / "answers-hdcal").keys() == {"c01.json", "c02.json"}
    assert not (fresh / "answers-hdcal.json").exists()
    refused(blind("open", "set", "--key", "set.key"), "answers-hdcal", "not frozen")
    refused(blind("open", "set", "--key", "set.key", "--by", "hdcal"), "not frozen")
    kept = seen(fresh / "answers-hdcal")
    assert blind("answer", "set").returncode == 0
    assert answered_cases == ["c01", "c02", "interrupted", "c03"]
    assert kept.items() <= seen(fresh / "answers-hdcal").items()


@pytest.mark.thorough
def test_several_processes_answer_the_same(
    fresh: Path, answered: Path, frozen_data: dict
):
    data = answer_set(fresh, diagnosers={"hdcal": by_library}, jobs=2)
    assert data == frozen_data
    names = {path.name for path in answered.glob("answers-hdcal*")}
    assert names == {"answers-hdcal", "answers-hdcal.json"}
    frozen = "answers-hdcal.json"
    assert (fresh / frozen).read_bytes() == (answered / frozen).read_bytes()
    assert seen(fresh / "answers-hdcal") == seen(answered / "answers-hdcal")


@pytest.fixture
def frozen_data(answered: Path) -> dict:
    """Frozen answers of one process."""
    return json.loads((answered / "answers-hdcal.json").read_text())


def test_a_case_that_breaks_is_named_and_the_others_are_kept(fresh: Path):
    with pytest.raises(RuntimeError, match="c02: ZeroDivisionError: by nothing"):
        answer_set(fresh, diagnosers={"w": sealing.wrong}, by="w")
    assert seen(fresh / "answers-w").keys() == {"c01.json"}


def test_an_unreadable_case_is_a_finding(tmp_path: Path):
    one = sealing.label("a")
    written = tmp_path / "set", [("deformation_mm\n1\n", one)], sealing.GEAR
    sealing.write_set(*written, tmp_path / "key")
    with pytest.raises(InputError, match=r"^a\.csv"):
        answer_set(tmp_path / "set", diagnosers={"a": by_library}, by="a")


def test_frozen_answers_are_not_answered_again(blind, frozen: Path):
    before = seen(frozen)
    refused(blind("answer", "set"), "answers-hdcal.json", "frozen", "Move it")
    assert seen(frozen) == before


def test_nobody_unknown_answers(blind, fresh: Path):
    refused(blind("answer", "set", "--by", "../x"), "nobody is called '../x'")
    with pytest.raises(InputError, match="cannot be part of a file's name"):
        answer_set(fresh, diagnosers={"../x": by_library}, by="../x")


def test_a_second_opening_is_the_first_again(blind, frozen: Path):
    opened = ["open", "set", "--key", "set.key", "--by", "hdcal"]
    first = blind(*opened)
    assert first.returncode == 0 and "NOT BLIND" not in first.stderr
    before = seen(frozen)
    second = blind(*opened)
    assert (second.returncode, second.stdout) == (0, first.stdout)
    assert seen(frozen) == before


def test_what_is_answered_after_the_opening_is_not_blind(blind, frozen: Path):
    assert blind("open", "set", "--key", "set.key").returncode == 0
    done = blind("answer", "set", "--by", "none")
    assert done.returncode == 0 and "NOT BLIND" in done.stderr
    assert not json.loads((frozen / "answers-none.json").read_text())["blind"]
    # Who says otherwise is not in the record of the first opening.
    change(frozen / "answers-none.json", blind=True)
    done = blind("open", "set", "--key", "set.key")
    assert "NOT BLIND: the answers of 'none'" in done.stderr
    said = json.loads((frozen / "result" / "opening.json").read_text())["answers"]
    assert {name: one["blind"] for name, one in said.items()} == {
        "hdcal": True,
        "none": False,
    }
    assert "none" not in json.loads((frozen / "opened.json").read_text())["answers"]


def test_all_that_was_frozen_before_stays_blind(blind, frozen: Path):
    assert blind("answer", "set", "--by", "none").returncode == 0
    opened = ["open", "set", "--key", "set.key", "--by"]
    assert blind(*opened, "hdcal").returncode == 0
    done = blind(*opened, "none")
    assert done.returncode == 0 and "NOT BLIND" not in done.stderr


def test_nothing_is_opened_without_answers(blind, fresh: Path):
    before = seen(fresh)
    refused(blind("open", "set", "--key", "set.key"), "no frozen answers")
    assert seen(fresh) == before


def edit_frozen(folder: Path) -> None:
    """Edit a frozen answer and forget the hash."""
    path = folder / "answers-hdcal.json"
    path.write_text(path.read_text().replace('"verdict": "none"', '"verdict": "named"'))


def edit_stamped(folder: Path) -> None:
    """Edit a frozen answer and stamp it again."""
    path = folder / "answers-hdcal.json"
    answers = json.loads(path.read_text())["answers"]
    change(path, answers=[{**answers[0], "verdict": "named"}, *answers[1:]])


def edit_label(folder: Path) -> None:
    """Exchange a label, by somebody who has the key and hashes the seal anew."""
    from dataclasses import replace

    from hdcal.blind.canonical import digest
    from hdcal.blind.seal import seal, unseal

    key = key_of(folder).read_bytes().strip()
    secret = unseal((folder / "sealed.bin").read_bytes(), key)
    labels = (replace(secret.labels[0], truth=("outliers",)), *secret.labels[1:])
    token = seal(replace(secret, labels=labels), key)
    (folder / "sealed.bin").write_bytes(token)
    data = json.loads((folder / "set.json").read_text())
    (folder / "set.json").write_text(
        json.dumps({**data, "sealed_sha256": digest(token)})
    )


def other_answers(folder: Path) -> None:
    """Put the answers of another set in the place of these."""
    other = sealed_set(folder.with_name("other"), seed=8)
    answer_set(other, diagnosers={"hdcal": by_library})
    shutil.rmtree(folder / "answers-hdcal")
    shutil.copy(other / "answers-hdcal.json", folder)


def replaced(path: str, old: str, new: str) -> Callable[[Path], object]:
    """Return what replaces the first of a text in a file."""

    def spoil(folder: Path) -> None:
        text = (folder / path).read_text()
        assert old in text
        (folder / path).write_text(text.replace(old, new, 1))

    return spoil


def cut(path: str) -> Callable[[Path], object]:
    """Return what leaves half of a file."""

    def spoil(folder: Path) -> None:
        data = (folder / path).read_bytes()
        (folder / path).write_bytes(data[: len(data) // 2])

    return spoil


def removed(path: str) -> Callable[[Path], object]:
    """Return what removes a file."""
    return lambda folder: (folder / path).unlink()


def added(path: str, text: str) -> Callable[[Path], object]:
    """Return what writes a file."""
    return lambda folder: (folder / path).write_text(text)


OF_A_SET = {
    "edited table": (replaced("cases/c01.csv", "0.02", "0.03"), "c01.csv: was changed"),
    "missing case": (removed("cases/c02.csv"), "c02.csv: is missing"),
    "extra case": (added("cases/c09.csv", ""), "c09.csv: is no case of this set"),
    "edited gear": (replaced("gear.toml", "40.0", "41.0"), "gear.toml: was changed"),
    "missing gear": (removed("gear.toml"), "gear.toml: is missing"),
    "half a seal": (cut("sealed.bin"), "sealed.bin: was changed or is incomplete"),
    "no seal": (removed("sealed.bin"), "sealed.bin: is missing"),
    "half a manifest": (cut("set.json"), "set.json: is no JSON, or only half"),
    "nan": (added("set.json", "[NaN]"), "set.json: is no JSON"),
    "deep": (added("set.json", "[" * 100_000), "set.json: is no JSON"),
    "list": (added("set.json", "[]"), "set.json: is not of the schema"),
    "edited manifest": (
        replaced("set.json", "minus:hysteresis", "minus:outliers"),
        "set.json: was changed",
    ),
    "climbing name": (replaced("set.json", '"c01"', '"../c01"'), "cannot name a case"),
    "no set": (removed("set.json"), "set: is no blind check"),
}


@pytest.mark.parametrize("kind", OF_A_SET)
@pytest.mark.parametrize("command", ["answer", "open"])
def test_a_spoiled_set_is_refused(blind, frozen: Path, kind: str, command: str):
    spoil, words = OF_A_SET[kind]
    spoil(frozen)
    before = seen(frozen.parent)
    asked = ["--by", "none"] if command == "answer" else ["--key", "set.key"]
    refused(blind(command, "set", *asked), words)
    assert seen(frozen.parent) == before


OF_ANSWERS = {
    "edited": (edit_frozen, "answers-hdcal.json: was edited"),
    "edited and stamped": (edit_stamped, "c01.json: is not the answer that was frozen"),
    "half": (cut("answers-hdcal.json"), "answers-hdcal.json: is no JSON"),
    "other set": (other_answers, "answers-hdcal.json: answers another set"),
    "one edited": (
        replaced("answers-hdcal/c03.json", '"none"', '"unknown"'),
        "c03.json: was edited",
    ),
    "one removed": (removed("answers-hdcal/c03.json"), "c03.json: is missing"),
    "one half": (cut("answers-hdcal/c01.json"), "c01.json: is no JSON"),
    "one more": (added("answers-hdcal/c09.json", "{}"), "c09.json: answers no case"),
    "not frozen": (removed("answers-hdcal.json"), "are not frozen"),
    "a list": (
        lambda folder: change(folder / "answers-hdcal.json", answers=3),
        "does not answer every case once",
    ),
    "fewer": (
        lambda folder: change(folder / "answers-hdcal.json", answers=[]),
        "does not answer every case once",
    ),
    "empty": (
        lambda folder: change(folder / "answers-hdcal.json", answers=[{}] * 3),
        "holds no answer to the case 'c01'",
    ),
    "renamed": (
        lambda folder: change(folder / "answers-hdcal.json", by="none"),
        "is not what 'hdcal blind answer' writes",
    ),
    "label": (edit_label, "sealed.bin: holds another label of 'c01'"),
    "opened": (added("opened.json", '{"schema":'), "opened.json: is no JSON"),
    "opened elsewhere": (
        added("opened.json", '{"schema": "hdcal.blind-opened/1", "answers": {}}'),
        "opened.json: was edited",
    ),
    "foreign result": (
        lambda folder: (folder / "result").write_text("mine"),
        "result: is a file",
    ),
}


@pytest.mark.parametrize("kind", OF_ANSWERS)
def test_spoiled_answers_or_labels_are_not_opened(blind, frozen: Path, kind: str):
    spoil, words = OF_ANSWERS[kind]
    spoil(frozen)
    before = seen(frozen.parent)
    refused(blind("open", "set", "--key", "set.key"), words)
    assert seen(frozen.parent) == before


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("none.key", "none.key: is missing"),
        ("other.key", "other.key: is not the key of this set"),
        ("short.key", "short.key: is no key"),
    ],
)
def test_only_the_key_of_the_set_opens(blind, frozen: Path, key: str, words: str):
    sealed_set(frozen.with_name("other"), seed=8)
    frozen.with_name("short.key").write_text("abc")
    before = seen(frozen.parent)
    refused(blind("open", "set", "--key", key), words)
    assert seen(frozen.parent) == before


def partly(folder: Path, **changed) -> None:
    """Leave one answer of some other version, and none frozen."""
    (folder / "answers-hdcal.json").unlink()
    (folder / "answers-hdcal" / "c03.json").unlink()
    path = folder / "answers-hdcal" / "c02.json"
    made_by = json.loads(path.read_text())["fingerprint"]
    change(path, fingerprint={**made_by, **changed})


@pytest.mark.parametrize("part", fingerprint())
def test_versions_are_never_mixed(blind, frozen: Path, part: str):
    partly(frozen, **{part: "0"})
    before = seen(frozen)
    done = blind("answer", "set")
    refused(done, "c02.json: mixed versions", part, "move set/answers-hdcal away")
    assert seen(frozen) == before


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (cut("answers-hdcal/c01.json"), "c01.json: is no JSON"),
        (replaced("answers-hdcal/c01.json", '"none"', '"named"'), "was edited"),
        (added("answers-hdcal/c09.json", "{}"), "c09.json: answers no case"),
        (
            lambda folder: shutil.copy(
                folder / "answers-hdcal" / "c01.json",
                folder / "answers-hdcal" / "c03.json",
            ),
            "c03.json: answers another set, case or name",
        ),
    ],
)
def test_a_spoiled_answer_is_not_gone_on_from(blind, frozen: Path, spoil, words: str):
    partly(frozen)
    spoil(frozen)
    before = seen(frozen)
    refused(blind("answer", "set"), words)
    assert seen(frozen) == before


def test_a_fingerprint_tells_what_was_changed(monkeypatch):
    from hdcal.diagnosis import model_posterior

    before = fingerprint.__wrapped__()
    assert fingerprint.__wrapped__() == before
    monkeypatch.setattr(model_posterior, "NAMED", 0.8)
    after = fingerprint.__wrapped__("minus:outliers")
    assert {key for key in before if before[key] != after[key]} == {
        "library_sha256",
        "thresholds_sha256",
    }


def test_a_set_asks_for_effects_that_exist(fresh: Path, tmp_path: Path):
    one = sealing.label("a", withheld=("gravity",))
    written = tmp_path / "future", [(sealing.table("a"), one)], sealing.GEAR
    sealing.write_set(*written, tmp_path / "key")
    with pytest.raises(InputError, match=r"set\.json: asks for .*'gravity'"):
        answer_set(tmp_path / "future")


def test_the_real_diagnosis_answers(here: Hdcal, tmp_path: Path):
    folder = sealed_set(tmp_path / "set", 1)
    done = here("blind", "answer", folder, "--json")
    assert done.returncode == 0, done.stderr
    (said,) = json.loads(done.stdout)["answers"]
    answer = CaseAnswer.from_plain(said)
    assert answer.case == "c01" and answer.p_value is not None
    assert sum(answer.probabilities.values()) == pytest.approx(1.0)
    assert {"none", "unknown", "contact_onset"} <= answer.probabilities.keys()


def test_cases_go_through_a_program_of_one_s_own(here: Hdcal, tmp_path: Path):
    rows = [f"{x:.3f},{200.0 * x:.2f}" for x in np.linspace(0.02, 0.5, 40)]
    (tmp_path / "own.csv").write_text("\n".join(["deformation_mm,force_N", *rows]))
    drawn = ("--cases", "3", "--mix", "effects", "--program", str(tmp_path / "own.csv"))
    out = tmp_path / "set"
    assert here("blind", "make", *drawn, "--out", str(out)).returncode == 0
    for path in (out / "cases").iterdir():
        table = np.genfromtxt(path, delimiter=",", names=True)
        np.testing.assert_allclose(
            table["deformation_mm"], np.linspace(0.02, 0.5, 40), atol=5e-4
        )
    wrong = ("--cases", "3", "--mix", "effects", "--program", str(tmp_path / "no.csv"))
    assert here("blind", "make", *wrong, "--out", str(tmp_path / "b")).returncode == 2
    assert not (tmp_path / "b").exists()
