"""A commitment cannot be changed afterwards, and a changed file is detected."""

import json
from dataclasses import replace

import pytest
from benchmarks.blind.answers import FROZEN, Frozen
from benchmarks.blind.cases import GEAR_TOML, draw_cases
from benchmarks.blind.opening import open_set
from benchmarks.blind.sealed_set import (
    KEY,
    MANIFEST,
    read_key,
    read_set,
    write_hashed,
    write_set,
)
from stub_diagnosers import answer

from hdcal.errors import InputError

SEED = 2**100 + 1


def made(folder, seed=SEED, count=4):
    """Write a set of the mix `effect` and its key beside it."""
    drawn = [(t.encode(), label) for t, label in draw_cases("effect", count, seed)]
    files = {"gear.toml": GEAR_TOML.encode()}
    key, more = folder / "set.key", {"mix": "effect", "seed": seed, "version": "0"}
    return write_set(folder / "set", key, drawn, files, **more), key


def answered(found, by="stub", blind=True) -> None:
    """Write frozen answers to a set."""
    answers = tuple(answer(entry.case, {"none": 1.0}) for entry in found.manifest.cases)
    made_by = "0" * 64
    frozen = Frozen(by, found.commitment, made_by, blind, answers)
    write_hashed(found.folder / f"answers-{by}.json", FROZEN, frozen)


def test_labels_are_in_the_key_only_and_agree_with_the_commitments(tmp_path):
    found, key = made(tmp_path)
    assert read_set(found.folder) == found
    assert read_key(found, key).seed == SEED
    assert key.stat().st_mode & 0o777 == 0o600
    public = b"".join(p.read_bytes() for p in found.folder.rglob("*") if p.is_file())
    assert str(SEED).encode() not in public
    assert b"truth" not in public and b'"r"' not in public


@pytest.mark.parametrize("change", [{"truth": ("hum",)}, {"r": 9.0}, {"clean": ()}])
def test_another_label_is_detected(tmp_path, change):
    found, path = made(tmp_path)
    key = read_key(found, path)
    labels = (*key.labels[:2], replace(key.labels[2], **change), *key.labels[3:])
    path.write_bytes(KEY.dump_json(replace(key, labels=labels)))
    with pytest.raises(InputError, match="another label of 'case-3'"):
        read_key(found, path)
    path.write_bytes(KEY.dump_json(replace(key, mix="rigs")))
    with pytest.raises(InputError, match="another mix or seed"):
        read_key(found, path)
    path.write_text("{}")
    with pytest.raises(InputError, match="is not what the blind check writes"):
        read_key(found, path)


def test_a_changed_public_file_is_detected(tmp_path):
    found, _ = made(tmp_path)
    table, manifest = found.folder / "cases" / "case-2.csv", found.folder / "set.json"
    original = table.read_bytes()
    table.write_bytes(original.replace(b"0.0", b"0.1", 1))
    found.gear.unlink()
    with pytest.raises(InputError) as error:
        read_set(found.folder)
    assert len(error.value.findings) == 2
    table.write_bytes(original)
    found.gear.write_bytes(GEAR_TOML.encode())
    text = manifest.read_text()
    manifest.write_text(text.replace('"version": "0"', '"version": "1"'))
    with pytest.raises(InputError, match="its hash does not fit"):
        read_set(found.folder)
    # Whoever makes the hash fit again has another commitment than the published one.
    write_hashed(manifest, MANIFEST, replace(found.manifest, version="1"))
    assert read_set(found.folder).commitment != found.commitment


@pytest.mark.thorough
def test_answers_frozen_after_the_first_opening_are_not_blind(tmp_path):
    found, key = made(tmp_path)
    answered(found, "before")
    assert "NOT BLIND" not in open_set(found.folder, key)
    # Even if they say that they are.
    answered(found, "later")
    printed = [
        x for x in open_set(found.folder, key).splitlines() if x.startswith("answ")
    ]
    assert [line.endswith("NOT BLIND") for line in printed[:2]] == [False, True]
    scores = json.loads((found.folder / "result" / "scores.json").read_text())
    assert scores["answers"]["before"]["blind"]
    assert not scores["answers"]["later"]["blind"]
