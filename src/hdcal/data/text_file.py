"""From bytes to text, checked while the bytes stream in."""

import codecs
import hashlib
from pathlib import Path

from hdcal.data.findings import FileFindings
from hdcal.data.regular_file import why_not_readable

CHUNK = 1 << 18
LONGEST_LINE = 1 << 20
LARGEST_FILE = 1 << 32

_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_text(path: Path, findings: FileFindings) -> tuple[bytes, str]:
    """Read a text file, refusing what is no text before it fills the memory.

    Args:
        path: where it is.
        findings: of the file.

    Returns:
        The text as UTF-8, without byte-order mark, each line ended by one newline;
        and the hash of the file's own bytes.

    Raises:
        InputError: missing, unreadable, a folder, binary, or a line over 1 MiB.
    """
    if (why := why_not_readable(path, LARGEST_FILE)) is not None:
        findings.refuse(*why)
    try:
        raw = _stream(path, findings)
    except FileNotFoundError:
        findings.refuse("does not exist", "Check the name and the folder")
    except PermissionError:
        findings.refuse("may not be read", "Give yourself the permission to read it")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        findings.refuse(f"cannot be read ({reason})", "Check the name and the disk")
    utf8 = _as_utf8(raw, findings)
    if b"\r" in utf8:
        utf8 = utf8.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return utf8, hashlib.sha256(raw).hexdigest()


def _stream(path: Path, findings: FileFindings) -> bytes:
    """The bytes; gives up at the first sign that this is not a table."""
    kept, line, row, size, wide = [], 0, 1, 0, False
    with open(path, "rb") as stream:
        while chunk := stream.read(CHUNK):
            if not kept:
                wide = chunk.startswith(_WIDE_MARKS)
            if chunk.startswith(b"PK\x03\x04") and not kept:
                findings.refuse("is a workbook or an archive", "Save it as CSV")
            if not wide and b"\0" in chunk:
                findings.refuse("is a binary file", "Save it as UTF-8 text")
            last = max(chunk.rfind(b"\n"), chunk.rfind(b"\r"))
            line = line + len(chunk) if last < 0 else len(chunk) - last - 1
            if line > LONGEST_LINE:
                row += sum(part.count(b"\n") for part in kept)
                words = "has a line of more than 1 MiB, so it is no table of readings"
                findings.refuse(words, "Write one row of readings per line", row)
            size += len(chunk)
            if size > LARGEST_FILE:
                remedy = "Split or thin out the readings"
                findings.refuse("is larger than 4 GiB", remedy)
            kept.append(chunk)
    return b"".join(kept)


def _as_utf8(raw: bytes, findings: FileFindings) -> bytes:
    if raw.startswith(_WIDE_MARKS):
        try:
            utf8 = raw.decode("utf-16").encode()
        except UnicodeError:
            findings.refuse("is broken UTF-16 text", "Save it as UTF-8 text")
        if b"\0" in utf8:
            findings.refuse("is a binary file", "Save it as UTF-8 text")
        return utf8
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError as error:
        row = raw.count(b"\n", 0, error.start) + 1
        findings.refuse("is not UTF-8 text", "Save it as UTF-8 text", row)
    return raw.removeprefix(codecs.BOM_UTF8)
