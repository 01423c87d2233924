"""What is sealed comes out unchanged or not at all."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from sealing import label

from hdcal.blind.canonical import Broken, canonical, digest, digest_agrees, with_digest
from hdcal.blind.label import Label
from hdcal.blind.manifest import Entry, Manifest, check_names
from hdcal.blind.seal import (
    Sealed,
    check_labels,
    commit,
    drawn_salt,
    library_of,
    new_key,
    new_salt,
    seal,
    unseal,
)

CSV = digest(b"data")
# Of the label below, as hdcal computed it before composites.
EARLIER = "a7296eecbc3fd15ef2d46ddbd78873e6d0f0c470cf53cf332e8903537eac01c2"


@pytest.fixture
def secret() -> Sealed:
    """Two labels."""
    labels = label("a"), label("b", withheld=("outliers", "hysteresis"))
    return Sealed("trial", 2**127 + 1, labels, (new_salt(), new_salt()))


@pytest.fixture
def manifest(secret: Sealed) -> Manifest:
    """What is public about them."""
    pairs = zip(secret.labels, secret.salts, strict=True)
    entries = tuple(
        Entry(one.case, CSV, commit(one, salt, CSV), library_of(one))
        for one, salt in pairs
    )
    return Manifest(entries, digest(b"gear"), digest(b"sealed"), {"hdcal": "1"})


def test_there_is_one_canonical_form():
    assert canonical({"b": (1, 2.5), "a": "δ"}) == b'{"a":"\\u03b4","b":[1,2.5]}'
    numpy = {"a": np.float64(0.1), "b": np.int64(3), "c": np.array([0.5]), "d": True}
    assert canonical(numpy) == b'{"a":0.1,"b":3,"c":[0.5],"d":true}'
    with pytest.raises(ValueError):
        canonical({"a": float("nan")})


def test_a_stamp_shows_every_change():
    data = with_digest({"a": 1, "b": [1.5]})
    assert digest_agrees(data) and digest_agrees(json.loads(json.dumps(data)))
    for changed in ({**data, "a": 2}, {**data, "c": 0}, {"b": [1.5]}):
        assert not digest_agrees(changed)


def test_a_commitment_is_that_of_salt_label_and_data():
    salt, plain = new_salt(), label("a")
    expected = digest(bytes.fromhex(salt) + canonical(plain.plain()) + CSV.encode())
    assert commit(plain, salt, CSV) == expected
    others = (
        commit(plain, new_salt(), CSV),
        commit(replace(plain, r=0.2), salt, CSV),
        commit(plain, salt, digest(b"other")),
    )
    assert expected not in others


@pytest.mark.parametrize(
    ("salt", "sha256"), [("", CSV), ("zz" * 16, CSV), ("00" * 15, CSV), ("00" * 16, "")]
)
def test_a_commitment_without_salt_or_data_is_refused(salt: str, sha256: str):
    with pytest.raises(Broken, match="wrong length"):
        commit(label("a"), salt, sha256)


def test_what_is_sealed_comes_out_bit_by_bit(secret: Sealed, manifest: Manifest):
    key = new_key()
    token = seal(secret, key)
    again = unseal(token, key)
    assert canonical(again.plain()) == canonical(secret.plain())
    assert isinstance(again.labels[0], Label) and again.seed == 2**127 + 1
    check_labels(manifest, again)
    assert b"hysteresis" not in token


def test_the_length_tells_nothing_of_the_label(secret: Sealed):
    short = Sealed("", 0, (label("a", truth=("x",)),), (new_salt(),))
    long = Sealed("", 0, (label("a", truth=("x" * 2000,)),), (new_salt(),))
    key = new_key()
    assert len(seal(short, key)) == len(seal(long, key)) == len(seal(secret, key))


def test_only_its_key_opens_a_seal(secret: Sealed):
    key = new_key()
    token = seal(secret, key)
    with pytest.raises(Broken, match="is not the key of this set"):
        unseal(token, new_key())
    with pytest.raises(Broken, match="is no key"):
        unseal(token, b"short")
    middle = len(token) // 2
    for spoiled in (token[:-8], b"", token[:middle] + b"A" + token[middle + 1 :]):
        if spoiled != token:
            with pytest.raises(Broken):
                unseal(spoiled, key)


def test_another_secret_of_the_same_key_is_no_set():
    from cryptography.fernet import Fernet

    key = new_key()
    for text in (
        b"\xff",
        b"[]",
        b"{}",
        b'{"labels": []}',
        b'{"labels": 3}',
        b'{"labels": [{"salt": 1}]}',
    ):
        with pytest.raises(Broken, match="no blind check"):
            unseal(Fernet(key).encrypt(text), key)


def test_every_exchanged_label_is_seen(secret: Sealed, manifest: Manifest):
    first, second = secret.labels
    salts = secret.salts
    exchanged = {
        "another label of 'a'": replace(
            secret, labels=(replace(first, truth=("outliers",)), second)
        ),
        "labels of other cases": replace(secret, labels=(second, first)),
        "another label of 'b'": replace(secret, salts=(salts[0], new_salt())),
    }
    for words, spoiled in exchanged.items():
        with pytest.raises(Broken, match=words):
            check_labels(manifest, spoiled)
    fewer = replace(secret, labels=(first,), salts=salts[:1])
    with pytest.raises(Broken, match="other cases"):
        check_labels(manifest, fewer)
    entry = replace(manifest.cases[1], library="")
    lenient = replace(manifest, cases=(manifest.cases[0], entry))
    with pytest.raises(Broken, match="withholds other effects from 'b'"):
        check_labels(lenient, secret)


def test_a_manifest_comes_back(manifest: Manifest):
    plain = json.loads(json.dumps(manifest.plain()))
    assert Manifest.from_plain(plain) == manifest
    assert manifest.cases[1].library == "minus:outliers,hysteresis"


def test_the_commitment_binds_cases_and_gear(manifest: Manifest):
    entry = manifest.cases[0]
    for name in asdict(entry):
        other = replace(entry, **{name: digest(name.encode())})
        changed = replace(manifest, cases=(other, manifest.cases[1]))
        assert changed.commitment != manifest.commitment, name
    assert replace(manifest, gear_sha256=CSV).commitment != manifest.commitment
    swapped = replace(manifest, cases=manifest.cases[::-1])
    assert swapped.commitment != manifest.commitment


def test_a_changed_manifest_is_refused(manifest: Manifest):
    plain = manifest.plain()
    first, second = plain["cases"]
    spoiled = {
        "lacks": [
            {key: value for key, value in plain.items() if key != gone}
            for gone in ("cases", "gear_sha256", "sealed_sha256", "commitment")
        ],
        "no SHA-256": [
            {**plain, "gear_sha256": "0"},
            {**plain, "cases": [{**first, "sha256": 3}, second]},
        ],
        "no text": [{**plain, "cases": [{**first, "library": None}, second]}],
        "was changed": [
            {**plain, "cases": [first]},
            {**plain, "cases": [{**first, "library": "minus:ovality"}, second]},
            {**plain, "gear_sha256": CSV},
            {**plain, "commitment": CSV},
        ],
        "cannot name": [{**plain, "cases": [{**first, "case": "../a"}, second]}],
        "of one name": [{**plain, "cases": [first, {**second, "case": "A"}]}],
        "no case": [{**plain, "cases": []}],
    }
    spoiled["lacks"] += [{**plain, "cases": x} for x in (3, ["a"], [{"x": 1}])]
    for words, forms in spoiled.items():
        for form in forms:
            with pytest.raises(Broken, match=words):
                Manifest.from_plain(form)


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "-a", "a b", "ä", "a" * 101, 3])
def test_a_name_cannot_be_a_path(name):
    check_names(["a-1", "B_2"])
    with pytest.raises(Broken, match="cannot name a case"):
        check_names(["a", name])


def test_a_seed_gives_the_same_salts_again():
    """So that a published seed lets anybody make the same commitment."""
    assert drawn_salt(2**127, "a") == drawn_salt(2**127, "a")
    salts = {drawn_salt(seed, case) for seed in (1, 2) for case in "ab"}
    assert len(salts) == 4
    assert {len(salt) for salt in salts} == {len(new_salt())}


def test_a_label_of_before_composites_keeps_its_commitment():
    """A set that was sealed by an earlier version has no word of what is beside."""
    label = Label("case-1", "effect", ("slack",), "rich", 180, 1.0, "iid", 0.0, 0.5)
    told = label.plain()
    assert not {"beside", "share"} & told.keys()
    assert Label.from_plain(told) == label
    mixed = replace(label, kind="composite", beside="burr", share=0.7)
    assert Label.from_plain(mixed.plain()) == mixed
    assert commit(label, "00" * 16, "ab" * 32) == EARLIER
