"""A set of the blind check on disk: written whole, and never believed unread."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from hdcal.blind.canonical import Broken, digest
from hdcal.blind.files import (
    GET_AGAIN,
    LARGEST_MANIFEST,
    read_checked,
    read_json,
    refusal,
)
from hdcal.blind.label import Label
from hdcal.blind.manifest import (
    FIRST_SCHEMA,
    SET_SCHEMA,
    Entry,
    Manifest,
    check_names,
)
from hdcal.blind.seal import (
    Sealed,
    commit,
    commit_origin,
    drawn_salt,
    library_of,
    new_key,
    new_salt,
    seal,
)
from hdcal.data.versions import versions
from hdcal.errors import Finding, Findings, InputError
from hdcal.report.plain import as_json
from hdcal.report.saving.disk import write_file
from hdcal.report.saving.reserve import reserve_file, reserve_folder
from hdcal.report.saving.target import TargetFile, TargetFolder

SET, SEALED, GEAR, MATERIAL = "set.json", "sealed.bin", "gear.toml", "material.toml"
CASES, RESULT = "cases", "result"
SCHEMAS = SET_SCHEMA, FIRST_SCHEMA
RESTORE_OPENED = "Restore the file; it tells which answers were blind"


@dataclass(frozen=True)
class BlindSet:
    """A set whose public part is what its commitment promises.

    Attributes:
        folder: where it is.
        manifest: what is public about it.
    """

    folder: Path
    manifest: Manifest

    @property
    def opened(self) -> Path:
        """File that tells when it was opened, and for which answers."""
        return self.folder / "opened.json"

    @property
    def was_opened(self) -> bool:
        """Whether it was opened before.

        Raises:
            InputError: a result says so, but the file that tells when is gone.
        """
        found = self.opened.exists()
        if not found and (self.folder / RESULT / "opening.json").exists():
            words = f"is missing, and {RESULT} says that the set was opened"
            raise refusal(self.opened, words, RESTORE_OPENED)
        return found

    def csv(self, entry: Entry) -> bytes:
        """Return the data of a case.

        Raises:
            InputError: they are missing or were changed.
        """
        path = self.folder / CASES / f"{entry.case}.csv"
        return read_checked(path, entry.sha256)

    def gear(self) -> bytes:
        """Return the gear file.

        Raises:
            InputError: it is missing or was changed.
        """
        return read_checked(self.folder / GEAR, self.manifest.gear_sha256)

    def material(self) -> bytes | None:
        """Return the material file, empty where the gear names a shipped material.

        None for an older set, whose material did not travel.

        Raises:
            InputError: it is missing or was changed.
        """
        if self.manifest.material_sha256 is None:
            return None if self.manifest.not_bound else b""
        return read_checked(self.folder / MATERIAL, self.manifest.material_sha256)

    def sealed(self) -> bytes:
        """Return the encrypted labels.

        Raises:
            InputError: they are missing or were changed.
        """
        return read_checked(self.folder / SEALED, self.manifest.sealed_sha256)


def read_set(folder: Path | str) -> BlindSet:
    """Read a set and verify everything that can be without the key.

    Raises:
        InputError: holds everything that is missing, too much or changed.
    """
    folder = Path(folder)
    if not (folder / SET).is_file():
        words = f"is no blind check: it holds no {SET}"
        raise refusal(folder, words, "Name a folder that 'hdcal blind make' has made")
    data = read_json(folder / SET, SCHEMAS, GET_AGAIN, LARGEST_MANIFEST)
    try:
        found = BlindSet(folder, Manifest.from_plain(data))
    except Broken as error:
        raise refusal(folder / SET, str(error), GET_AGAIN) from None
    findings: list[Finding] = []
    reads: list[Callable[[], object]] = [found.gear, found.material, found.sealed]
    reads += [lambda: found.was_opened]
    reads += [lambda entry=entry: found.csv(entry) for entry in found.manifest.cases]
    for read in reads:
        try:
            read()
        except InputError as error:
            findings += error.findings
    known = {f"{entry.case}.csv" for entry in found.manifest.cases}
    for path in sorted((folder / CASES).glob("*.csv")):
        if path.name not in known:
            words, remedy = "is no case of this set", "Take it out of the folder"
            findings.append(Finding(str(path), words, remedy))
    if findings:
        raise InputError(findings)
    return found


def write_set(
    target: Path | str,
    drawn: Iterable[tuple[str | bytes, Label]],
    gear: str | bytes,
    key: Path,
    *,
    material: bytes | None = None,
    mix: str = "",
    seed: int | None = None,
    force: bool = False,
) -> Manifest:
    """Write a set and, beside it, its key.

    Args:
        target: the folder to make.
        drawn: table and label of each case; first asked when both may be written.
        gear: text of the gear file of all of them.
        key: the file to make, readable to its owner only; no other is ever replaced.
        material: the file of the gear's material, where hdcal ships none.
        mix: name of the mix, sealed with the labels.
        seed: of the mix, sealed too; salts follow from it. None for a measurement.
        force: whether an older set without answers may be replaced.

    Raises:
        InputError: the target or the key exists, or the key would lie in the set;
            or one of them appeared meanwhile, and set or key lies beside it.
        NotWritable: the disk refused.
    """
    _check_key(key, target)
    secret = new_key()
    with (
        Findings() as wrong,
        reserve_folder(target, force=force, unstamped=_plain_set) as folder,
        reserve_file(key) as file,
        _removed_without(folder, file, secret),
        folder.filled() as into,
    ):
        manifest = _fill(into, drawn, _encoded(gear), material, secret, mix, seed)
        # No set is ever seen without its key, which may have to go beside its place.
        wrong.attempt(file.write, secret + b"\n", 0o600)
    return manifest


def _fill(
    into: Path,
    drawn: Iterable[tuple[str | bytes, Label]],
    gear: bytes,
    material: bytes | None,
    secret: bytes,
    mix: str,
    seed: int | None,
) -> Manifest:
    labels, salts, entries = [], [], []
    (into / CASES).mkdir()
    for table, label in drawn:
        check_names([label.case])
        data = _encoded(table)
        salt = new_salt() if seed is None else drawn_salt(seed, label.case)
        write_file(into / CASES / f"{label.case}.csv", data)
        promise = commit(label, salt, digest(data))
        entries.append(Entry(label.case, digest(data), promise, library_of(label)))
        labels.append(label)
        salts.append(salt)
    check_names([entry.case for entry in entries])
    write_file(into / GEAR, gear)
    if material is not None:
        write_file(into / MATERIAL, material)
    # No case has an empty name.
    salt = new_salt() if seed is None else drawn_salt(seed, "")
    manifest = Manifest(
        tuple(entries),
        digest(gear),
        "",
        versions(),
        commit_origin(mix, seed or 0, salt),
        None if material is None else digest(material),
    )
    parts = mix, seed or 0, tuple(labels), tuple(salts), salt, manifest.commitment
    token = seal(Sealed(*parts), secret)
    write_file(into / SEALED, token)
    manifest = replace(manifest, sealed_sha256=digest(token))
    write_file(into / SET, as_json(manifest.plain()).encode())
    return manifest


def _check_key(key: Path, target: Path | str) -> None:
    if key.resolve().is_relative_to(Path(os.path.realpath(target))):
        words = "would lie inside the set, which it opens"
        raise refusal(key, words, "Name a place outside with `key`")
    if os.path.lexists(key):
        words = "exists already, and may be the only key to another set"
        raise refusal(key, words, "Name another file with `key`, or move it away")


def _plain_set(folder: Path) -> list[str]:
    """Return the files of an intact set without a stamp; of any other none."""
    try:
        cases = read_set(folder).manifest.cases
    except InputError:
        return []
    return [
        SET,
        SEALED,
        GEAR,
        MATERIAL,
        *(f"{CASES}/{entry.case}.csv" for entry in cases),
    ]


@contextmanager
def _removed_without(
    folder: TargetFolder, key: TargetFile, secret: bytes
) -> Iterator[None]:
    """Remove a key where there is no set that it opens."""
    try:
        yield
    except BaseException:
        path = None if folder.written is not None else key.written
        if path is not None and path.read_bytes().strip() == secret:
            path.unlink()
        raise


def _encoded(text: str | bytes) -> bytes:
    return text.encode() if isinstance(text, str) else text
