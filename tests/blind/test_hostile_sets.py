"""Sets, answers and keys from strangers: a finding each, never a crash or a loss."""

import json
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import sealing
from commands import XB1, Hdcal
from cryptography.fernet import Fernet
from mutations import damaged_bytes, damaged_data, damaged_text
from sealing import key_of, sealed_set

from hdcal.blind.answering import answer_set
from hdcal.blind.canonical import canonical, digest, with_digest
from hdcal.blind.diagnosers import DIAGNOSERS
from hdcal.blind.seal import seal, unseal
from hdcal.errors import InputError

OPEN = ("open", "set", "--key", "set.key")
ANSWER = ("answer", "set", "--by", "none")

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture
def blind(here: Hdcal, monkeypatch: pytest.MonkeyPatch) -> Hdcal:
    """Run `hdcal blind` with a cheap diagnoser."""
    monkeypatch.setitem(DIAGNOSERS, "hdcal", sealing.by_library)
    return lambda *arguments: here("blind", *arguments)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a set, its answers and its key, to be copied."""
    folder = sealed_set(tmp_path_factory.mktemp("made") / "set")
    answer_set(folder, diagnosers={"hdcal": sealing.by_library})
    return folder.parent


@pytest.fixture
def frozen(made: Path, tmp_path: Path) -> Path:
    """A set with frozen answers."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path / "set"


def seen(folder: Path) -> dict[str, bytes]:
    """Return every file below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def refused(blind: Hdcal, arguments: tuple, folder: Path, *words: str) -> None:
    """Check that a command was refused in one line and changed nothing."""
    before = seen(folder)
    done = blind(*arguments)
    assert done.returncode == 2 and not done.stdout, done.stderr
    lines = [line for line in done.stderr.splitlines() if line]
    assert len(lines) == 1 and all(word in lines[0] for word in words), done.stderr
    assert seen(folder) == before


def manifest_of(folder: Path) -> dict:
    """Return the manifest of a set."""
    return json.loads((folder / "set.json").read_text())


def rewrite(folder: Path, **changed) -> None:
    """Edit a manifest, and make its commitment and that of all answers fit again."""
    plain = {**manifest_of(folder), **changed}
    plain["commitment"] = commitment_of(plain)
    (folder / "set.json").write_text(json.dumps(plain))
    for path in (*folder.glob("answers-*.json"), *folder.glob("answers-*/*.json")):
        data = {**json.loads(path.read_text()), "set_commitment": plain["commitment"]}
        del data["sha256"]
        path.write_text(json.dumps(with_digest(data)))


def commitment_of(plain: dict) -> str:
    """Return the commitment as docs/blind-check.md defines it."""
    promised = {key: plain[key] for key in ("cases", "gear_sha256")}
    if plain["schema"] == "hdcal.blind/2":
        promised |= {key: plain[key] for key in ("schema", "material_sha256", "origin")}
        promised["case_count"] = len(plain["cases"])
        promised["version"] = plain["versions"]["hdcal"]
    return digest(canonical(promised))


def exchanged(plain: dict) -> dict[str, dict]:
    """Return what of a manifest can be edited, by what that is."""
    first, *others = plain["cases"]
    return {
        "origin": {"origin": "0" * 64},
        "version": {"versions": {**plain["versions"], "hdcal": "9.9"}},
        "fewer cases": {"cases": plain["cases"][:-1]},
        "more cases": {"cases": [*plain["cases"], {**first, "case": "c09"}]},
        "other order": {"cases": [*others, first]},
        "material": {"material_sha256": "0" * 64},
        "gear": {"gear_sha256": "0" * 64},
    }


def test_the_commitment_is_as_it_is_published(made: Path):
    plain = manifest_of(made / "set")
    assert plain["schema"] == "hdcal.blind/2"
    assert plain["commitment"] == commitment_of(plain)
    assert all(commitment_of({**plain, **one}) != plain["commitment"]
               for one in exchanged(plain).values())  # fmt: skip


@pytest.mark.parametrize("what", ["origin", "version", "fewer cases", "material"])
@pytest.mark.parametrize("command", [ANSWER, OPEN])
def test_an_edited_manifest_is_refused(blind, frozen: Path, what: str, command):
    plain = manifest_of(frozen)
    edited = {**plain, **exchanged(plain)[what]}
    (frozen / "set.json").write_text(json.dumps(edited))
    refused(blind, command, frozen.parent, "set.json: was changed")


@pytest.mark.parametrize("what", ["origin", "version"])
def test_what_is_sealed_shows_a_manifest_whose_commitment_was_made_to_fit(
    blind, frozen: Path, what: str
):
    rewrite(frozen, **exchanged(manifest_of(frozen))[what])
    words = {"origin": "another mix or seed", "version": "sealed for another set"}
    refused(blind, OPEN, frozen.parent, "sealed.bin: ", words[what])


def resealed(folder: Path, **changed) -> None:
    """Seal something else, as only the keeper of the key can."""
    key = key_of(folder).read_bytes().strip()
    secret = unseal((folder / "sealed.bin").read_bytes(), key)
    token = seal(replace(secret, **changed), key)
    (folder / "sealed.bin").write_bytes(token)
    rewrite(folder, sealed_sha256=digest(token))


@pytest.mark.parametrize(
    "changed", [{"mix": "other"}, {"seed": 8}, {"origin_salt": "00" * 16}]
)
def test_who_made_a_set_cannot_tell_of_another_mix_or_seed(
    blind, frozen: Path, changed: dict
):
    resealed(frozen, **changed)
    refused(blind, OPEN, frozen.parent, "holds another mix or seed than was promised")


def test_mix_and_seed_stay_secret_and_the_same_draw_commits_anew(tmp_path: Path):
    """Of a set its public part tells neither; whoever learns them gets the same."""
    a, b = (sealed_set(tmp_path / name) for name in "ab")
    other = sealed_set(tmp_path / "c", seed=8)
    origins = [manifest_of(each)["origin"] for each in (a, b, other)]
    assert origins[0] == origins[1] != origins[2]
    # Without the salt nobody can try mixes and seeds.
    assert origins[0] != digest(canonical({"mix": "trial", "seed": 7}))
    assert manifest_of(a)["commitment"] == manifest_of(b)["commitment"]


def first_schema(folder: Path) -> None:
    """Make a set what v0.1 would have written."""
    key = key_of(folder).read_bytes().strip()
    lock = Fernet(key)
    secret = json.loads(lock.decrypt((folder / "sealed.bin").read_bytes()))
    del secret["origin_salt"], secret["commitment"]
    token = lock.encrypt(canonical({**secret, "schema": "hdcal.blind-labels/1"}))
    (folder / "sealed.bin").write_bytes(token)
    plain = manifest_of(folder)
    del plain["origin"], plain["material_sha256"]
    plain |= {"schema": "hdcal.blind/1", "sealed_sha256": digest(token)}
    plain["commitment"] = commitment_of(plain)
    (folder / "set.json").write_text(json.dumps(plain))


def test_an_older_set_opens_and_says_what_it_does_not_bind(blind, tmp_path: Path):
    folder = sealed_set(tmp_path / "set")
    first_schema(folder)
    assert blind("answer", "set").returncode == 0
    done = blind(*OPEN)
    assert done.returncode == 0, done.stderr
    assert "does not bind: mix, seed, version" in done.stderr
    said = json.loads((folder / "result" / "opening.json").read_text())
    assert said["not_bound"] == ["mix", "seed", "version"]
    labels = json.loads((folder / "result" / "labels.json").read_text())
    assert labels["schema"] == "hdcal.blind-labels/1" and "origin_salt" not in labels


def test_a_set_cannot_be_passed_off_as_an_older_one(blind, frozen: Path):
    plain = manifest_of(frozen)
    del plain["origin"], plain["material_sha256"]
    (frozen / "set.json").write_text(json.dumps({**plain, "schema": "hdcal.blind/1"}))
    refused(blind, OPEN, frozen.parent, "set.json: was changed")
    rewrite(frozen)
    refused(blind, OPEN, frozen.parent, "another mix or seed than was promised")


@pytest.fixture
def own_steel(blind: Hdcal, tmp_path: Path) -> Path:
    """A sealed measurement of a gear whose material is a file of its owner."""
    folder = tmp_path / "mine"
    (folder / "steels").mkdir(parents=True)
    shutil.copy(XB1 / "data.csv", folder)
    steel = Path(__file__).parents[2] / "priors" / "steel.toml"
    shutil.copy(steel, folder / "steels" / "own.toml")
    text = (XB1 / "gear.toml").read_text()
    (line,) = [one for one in text.splitlines() if one.startswith("material")]
    own = text.replace(line, 'material = "steels/own.toml"')
    (folder / "gear.toml").write_text(own)
    given = ("--from", folder / "data.csv", "--gear", folder / "gear.toml")
    done = blind("make", *given, "--cause", "unknown", "--out", "set")
    assert done.returncode == 0, done.stderr
    shutil.rmtree(folder)
    return tmp_path / "set"


def test_a_material_file_travels_with_the_set(
    blind, own_steel: Path, tmp_path: Path, monkeypatch
):
    there = tmp_path / "elsewhere"
    there.mkdir()
    for path in (own_steel, key_of(own_steel)):
        path.rename(there / path.name)
    monkeypatch.chdir(there)
    assert b"[E0]" in (there / "set" / "material.toml").read_bytes()
    assert blind("answer", "set", "--jobs", "2").returncode == 0
    done = blind(*OPEN)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda path: path.write_text(path.read_text() + "\n"), "was changed"),
        (Path.unlink, "is missing"),
    ],
)
@pytest.mark.parametrize("command", [ANSWER, OPEN])
def test_another_material_is_refused(blind, own_steel: Path, spoil, words, command):
    spoil(own_steel / "material.toml")
    refused(blind, command, own_steel.parent, f"material.toml: {words}")


def test_a_set_reads_no_file_outside_of_it(frozen: Path, tmp_path: Path):
    """Whatever material a stranger's gear file names."""
    shutil.copy(Path(__file__).parents[2] / "priors" / "steel.toml", tmp_path)
    steel = tmp_path / "steel.toml"
    gear = sealing.GEAR.replace('"steel"', json.dumps(str(steel)))
    one = sealing.label("a")
    place = tmp_path / "foreign"
    sealing.write_set(place, [(sealing.table("a"), one)], gear, tmp_path / "key")
    with pytest.raises(InputError, match="the material says nothing of E0"):
        answer_set(place, diagnosers={"a": sealing.by_library}, by="a")


def written(name: str, data: bytes | str) -> Callable[[Path], object]:
    """Return what writes a file of a set, or its key."""
    raw = data.encode() if isinstance(data, str) else data
    return lambda folder: (folder / name).write_bytes(raw)


def enlarged(name: str, size: int) -> Callable[[Path], object]:
    """Return what makes a file large without writing it."""

    def spoil(folder: Path) -> None:
        with open(folder / name, "ab") as file:
            file.truncate(size)

    return spoil


def answered_with(text: str) -> Callable[[Path], object]:
    """Return what puts a text in the place of a p-value of the frozen answers."""

    def spoil(folder: Path) -> None:
        path = folder / "answers-hdcal.json"
        path.write_text(path.read_text().replace('"p_value": 0.5', text, 1))

    return spoil


def piped(name: str) -> Callable[[Path], object]:
    """Return what puts a pipe that never ends in the place of a file."""

    def spoil(folder: Path) -> None:
        (folder / name).unlink()
        os.mkfifo(folder / name)

    return spoil


FROZEN, ONE, KEY = "answers-hdcal.json", "answers-hdcal/c01.json", "../set.key"
NO_JSON = "is no JSON, or only half of it"
HOSTILE = {
    "200 MB of answers": (enlarged(FROZEN, 200_000_000), f"{FROZEN}: is larger than"),
    "200 MB of one": (enlarged(ONE, 200_000_000), "c01.json: is larger than 1 MiB"),
    "huge manifest": (enlarged("set.json", 1 << 27), "set.json: is larger than 32 MiB"),
    "huge record": (enlarged("opened.json", 1 << 27), "opened.json: is larger than"),
    "huge seal": (enlarged("sealed.bin", 1 << 31), "sealed.bin: is larger than 1 GiB"),
    "huge key": (enlarged(KEY, 1 << 20), "set.key: is larger than 1 KiB"),
    "piped answers": (piped(FROZEN), f"{FROZEN}: is a pipe"),
    "deep": (answered_with('"p_value": ' + "[" * 100_000), f"{FROZEN}: {NO_JSON}"),
    "half deep": (
        answered_with('"p_value": ' + "[" * 900 + "]" * 900),
        f"{FROZEN}: was edited",
    ),
    "not finite": (answered_with('"p_value": 1e999'), f"{FROZEN}: {NO_JSON}"),
    "nan": (answered_with('"p_value": NaN'), f"{FROZEN}: {NO_JSON}"),
    "digits": (answered_with('"p_value": ' + "9" * 6000), f"{FROZEN}: {NO_JSON}"),
    "twice": (answered_with('"p_value": 0.5, "p_value": 0.5'), f"{FROZEN}: {NO_JSON}"),
    "latin": (written(ONE, b'{"schema": "\xe9"}'), f"c01.json: {NO_JSON}"),
    "stray copy": (
        lambda folder: shutil.copy(folder / FROZEN, folder / "answers-hdcal (1).json"),
        "answers-hdcal (1).json: is no file of this set",
    ),
    "no key": (written(KEY, b"\xff\xfe\x00"), "set.key: is no key"),
    "more": (
        lambda folder: written(
            "set.json", json.dumps({**manifest_of(folder), "more": 1})
        )(folder),
        "set.json: lacks something that every set has, or holds more",
    ),
    "no text": (
        lambda folder: rewrite(folder, versions={"hdcal": "1", "jax": 3}),
        "set.json: holds a version that is no text",
    ),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_files_are_refused(blind, frozen: Path, kind: str):
    HOSTILE[kind][0](frozen)
    before = set(frozen.parent.rglob("*"))
    done = blind(*OPEN)
    assert done.returncode == 2 and not done.stdout
    lines = [line for line in done.stderr.splitlines() if line]
    assert len(lines) == 1 and HOSTILE[kind][1] in lines[0], done.stderr
    assert set(frozen.parent.rglob("*")) == before


def test_a_byte_order_mark_changes_nothing(blind, frozen: Path):
    for name in ("set.json", FROZEN, ONE):
        path = frozen / name
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert blind(*OPEN).returncode == 0


ODD_ANSWERS = {
    "number for a word": {"effect": 3},
    "list for a truth value": {"detected": [True]},
    "two quantiles": {"gap": [0.1, 0.2]},
    "no probability": {"probabilities": {"none": 2.0}},
    "a name for tables": {"effect": "$x^$"},
    "half a letter": {"effect": "\ud800"},
    "more": {"more": 1},
    "a large number": {"noise_sd": 10**400},
}


@pytest.mark.parametrize("kind", ODD_ANSWERS)
def test_answers_of_other_types_are_refused(blind, frozen: Path, kind: str):
    """Though whoever wrote them stamped them well."""
    shutil.rmtree(frozen / "answers-hdcal")
    path = frozen / FROZEN
    data = json.loads(path.read_text())
    data["answers"][0] |= ODD_ANSWERS[kind]
    del data["sha256"]
    path.write_text(json.dumps(with_digest(data)))
    refused(blind, OPEN, frozen.parent, "holds no answer to the case 'c01'")


ODD_LABELS = {
    "rows": "many",
    "oracle": {"none": "surely"},
    "truth": [None],
    "clean": [[1.0]],
    "sigma": -1.0,
    "more": 1,
}


@pytest.mark.parametrize("field", ODD_LABELS)
def test_labels_of_other_types_are_refused(blind, frozen: Path, field: str):
    """Though whoever sealed them has the key."""
    lock = Fernet(key_of(frozen).read_bytes().strip())
    secret = json.loads(lock.decrypt((frozen / "sealed.bin").read_bytes()))
    secret["labels"][0]["label"][field] = ODD_LABELS[field]
    token = lock.encrypt(json.dumps(secret).encode())
    (frozen / "sealed.bin").write_bytes(token)
    rewrite(frozen, sealed_sha256=digest(token))
    refused(blind, OPEN, frozen.parent, "opens what no blind check has sealed")


def test_a_second_opening_says_so_and_loses_nothing(blind, frozen: Path):
    first = blind(*OPEN)
    assert first.returncode == 0 and "opened before" not in first.stderr
    before = seen(frozen.parent)
    when = json.loads(before["set/opened.json"])["time"]
    second = blind(*OPEN)
    assert (second.returncode, second.stdout) == (0, first.stdout)
    assert f"this set was opened before, at {when}" in second.stderr
    assert seen(frozen.parent) == before


def test_an_opened_set_is_not_opened_by_another_key(blind, frozen: Path):
    sealed_set(frozen.with_name("other"), seed=8)
    assert blind(*OPEN).returncode == 0
    other = (*OPEN[:-1], "other.key")
    refused(blind, other, frozen.parent, "other.key: is not the key of this set")


@pytest.mark.parametrize("command", [ANSWER, OPEN])
def test_an_opened_set_cannot_be_made_to_look_unopened(blind, frozen: Path, command):
    assert blind(*OPEN).returncode == 0
    (frozen / "opened.json").unlink()
    words = "opened.json: is missing, and result says that the set was opened"
    refused(blind, command, frozen.parent, words)


FUZZED = 150


def spoil_at_random(folder: Path, rng: random.Random) -> None:
    """Damage one file, or an answer and its hash."""
    files = [path for path in sorted(folder.parent.rglob("*")) if path.is_file()]
    path = rng.choice(files)
    if path.suffix != ".json" or rng.random() < 0.2:
        path.write_bytes(damaged_bytes(path.read_bytes(), rng))
        return
    data = json.loads(path.read_text())
    if rng.random() < 0.3:
        path.write_text(damaged_text(data, rng))
        return
    data = damaged_data(data, rng)
    data.pop("sha256", None)
    path.write_text(json.dumps(data if path.name == "set.json" else with_digest(data)))


def test_random_damage_is_a_finding_or_does_no_harm(
    blind, made: Path, tmp_path: Path, monkeypatch
):
    # What is drawn and written there is the business of other tests.
    monkeypatch.setattr("hdcal.blind.open.write_report", lambda *_: None)
    rng, codes = random.Random(11), []
    for number in range(FUZZED):
        for path in tmp_path.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        shutil.copytree(made, tmp_path, dirs_exist_ok=True)
        try:
            spoil_at_random(tmp_path / "set", rng)
        except ValueError:  # no JSON can say it
            continue
        before = seen(tmp_path)
        done = blind(*rng.choice([ANSWER, OPEN]))
        codes.append(done.returncode)
        assert done.returncode in (0, 2), (number, done.stderr)
        assert "Traceback" not in done.stderr
        assert done.returncode == 0 or done.stderr.startswith("hdcal: ")
        assert before.items() <= seen(tmp_path).items(), number
    assert codes.count(2) > FUZZED // 3 and codes.count(0) > FUZZED // 10
