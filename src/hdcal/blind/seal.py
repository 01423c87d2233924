"""The seal of the blind check: what stays secret, and what was promised of it.

Nothing here touches the disk.
"""

import secrets
from dataclasses import dataclass, replace
from typing import Any

from cryptography.fernet import Fernet, InvalidToken

from hdcal.blind.canonical import Broken, canonical, digest
from hdcal.blind.label import Label
from hdcal.blind.manifest import HASH, Manifest
from hdcal.data.typed_json import STRICT, parse_json, typed

LABELS_SCHEMA, FIRST_SCHEMA = "hdcal.blind-labels/2", "hdcal.blind-labels/1"
_SALT_BYTES = 16
# One label's length tells of what it holds; of a single case it would be seen.
_PADDING = 1 << 16


def new_salt() -> str:
    """Return what keeps a commitment from being guessed, in hexadecimal digits."""
    return secrets.token_hex(_SALT_BYTES)


def drawn_salt(seed: int, case: str) -> str:
    """Return the salt of a drawn case: whoever learns the seed can commit anew.

    The seed is as secret as the labels, which it makes.
    """
    return digest(canonical(["salt", seed, case]))[: 2 * _SALT_BYTES]


def commit(label: Label, salt: str, csv_sha256: str) -> str:
    """Return the commitment to one label: it tells nothing and binds its maker.

    Args:
        label: what is sealed.
        salt: 16 random bytes in hexadecimal digits.
        csv_sha256: hash of the case's data.

    Raises:
        Broken: the salt is none.
    """
    # Salt and hash have one length, so that no two triples give the same bytes.
    if not HASH.fullmatch(csv_sha256):
        raise Broken("holds a salt or a hash of the wrong length")
    return digest(_random(salt) + canonical(label.plain()) + csv_sha256.encode())


def commit_origin(mix: str, seed: int, salt: str) -> str:
    """Return the commitment to where the cases come from, which stays secret too.

    Raises:
        Broken: the salt is none.
    """
    return digest(_random(salt) + canonical({"mix": mix, "seed": seed}))


def _random(salt: str) -> bytes:
    try:
        random = bytes.fromhex(salt)
    except (TypeError, ValueError):
        random = b""
    if len(random) != _SALT_BYTES:
        raise Broken("holds a salt or a hash of the wrong length")
    return random


@dataclass(frozen=True)
class Sealed:
    """What is secret about a set.

    Attributes:
        mix: name of the mix; empty for a measurement.
        seed: whoever knows it can draw the same cases again.
        labels: in the order of the set.
        salts: of the commitments, in the same order.
        origin_salt: of the commitment to mix and seed; None in an older set, as:
        commitment: to the set that this was sealed for.
    """

    __pydantic_config__ = STRICT

    mix: str
    seed: int
    labels: tuple[Label, ...]
    salts: tuple[str, ...]
    origin_salt: str | None = None
    commitment: str | None = None

    def plain(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        pairs = zip(self.salts, self.labels, strict=True)
        found = {
            "schema": FIRST_SCHEMA,
            "mix": self.mix,
            "seed": self.seed,
            "labels": [{"salt": salt, "label": one.plain()} for salt, one in pairs],
        }
        if self.origin_salt is None:
            return found
        origin = {"origin_salt": self.origin_salt, "commitment": self.commitment}
        return {**found, **origin, "schema": LABELS_SCHEMA}


def new_key() -> bytes:
    """Return a random key."""
    return Fernet.generate_key()


def seal(secret: Sealed, key: bytes) -> bytes:
    """Return the secret, encrypted and authenticated."""
    text = canonical(secret.plain())
    return Fernet(key).encrypt(text + b" " * (-len(text) % _PADDING))


def unseal(token: bytes, key: bytes) -> Sealed:
    """Return what was sealed.

    Raises:
        Broken: the key is no key, or not the one it was sealed with.
    """
    try:
        lock = Fernet(key)
    except ValueError:
        raise Broken("is no key") from None
    try:
        data = parse_json(lock.decrypt(token))
        schema, pairs = data.pop("schema"), data.pop("labels")
        labels = tuple(Label.from_plain(pair["label"]) for pair in pairs)
        salts = [pair["salt"] for pair in pairs]
        found = typed(Sealed, {**data, "labels": [], "salts": salts})
    except InvalidToken:
        raise Broken("is not the key of this set") from None
    except (KeyError, TypeError, AttributeError, ValueError):
        raise Broken("opens what no blind check has sealed") from None
    found = replace(found, labels=labels)
    if schema != found.plain()["schema"]:
        raise Broken("opens what another version has sealed")
    return found


def check_labels(manifest: Manifest, secret: Sealed) -> None:
    """Hold what was sealed against what was promised.

    Raises:
        Broken: a label, mix or seed is not the one that was committed to, or it was
            sealed for other content than the manifest's.
    """
    promised = [entry.case for entry in manifest.cases]
    if [label.case for label in secret.labels] != promised:
        raise Broken("holds labels of other cases than the set")
    parts = zip(manifest.cases, secret.labels, secret.salts, strict=True)
    for entry, label, salt in parts:
        if commit(label, salt, entry.sha256) != entry.commitment:
            raise Broken(f"holds another label of '{entry.case}' than was promised")
        if library_of(label) != entry.library:
            raise Broken(f"withholds other effects from '{entry.case}' than the set")
    salt = secret.origin_salt
    origin = salt and commit_origin(secret.mix, secret.seed, salt)
    if origin != manifest.origin:
        raise Broken("holds another mix or seed than was promised")
    if salt and secret.commitment != manifest.commitment:
        raise Broken("was sealed for another set, or the set was changed since")


def library_of(label: Label) -> str:
    """Return which effects a case leaves out, as `--library` reads it."""
    return "minus:" + ",".join(label.withheld) if label.withheld else ""
