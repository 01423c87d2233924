"""Write a result onto a small disk that is more or less full already.

Run as a script that may mount: in a mount namespace of its own.
"""

import json
import subprocess
import sys
from pathlib import Path

from hdcal.errors import InputError, NotWritable
from hdcal.report.saving.disk import write_file
from hdcal.report.saving.reserve import reserve_folder


def tried(disk: Path, files: dict[str, bytes], force: bool) -> str:
    """Return how an attempt to write a result ended."""
    try:
        with (
            reserve_folder(disk / "run", force=force) as place,
            place.filled() as building,
        ):
            for name, content in files.items():
                write_file(building / name, content)
    except NotWritable as error:
        return "full" if "No space left on device" in str(error) else str(error)
    except InputError as error:
        return "full at once" if "No space left" in str(error) else str(error)
    return "written"


def main(files_from: str, disk_at: str, size: int) -> None:
    """Print one outcome for every amount of free space, from none to enough."""
    disk = Path(disk_at)
    # Every file and folder takes one of the disk's nodes.
    options = f"size={size},nr_inodes=64"
    mount = ["mount", "-t", "tmpfs", "-o", options, "none", disk_at]
    if subprocess.run(mount, capture_output=True).returncode != 0:
        print(json.dumps(None))
        return
    files = {path.name: path.read_bytes() for path in Path(files_from).iterdir()}
    files.pop("hdcal-result.json")
    small = {"summary.json": b"{}"}
    outcomes = []
    for step in range(60):
        force = step % 2 == 1
        if force:
            assert tried(disk, small, force=False) == "written"
        before = {path: path.read_bytes() for path in disk.rglob("*.*")}
        taken = size * (59 - step) // 59 - (16_384 if force else 0)
        (disk / "ballast").write_bytes(bytes(max(0, taken)))
        said = tried(disk, files, force)
        (disk / "ballast").unlink()
        after = {path: path.read_bytes() for path in disk.rglob("*.*")}
        same = after == before and not list(disk.glob(".hdcal-*"))
        outcomes.append((said, same))
        if said == "written":
            assert tried(disk, small, force=True) == "written"
        for path in sorted(disk.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
    print(json.dumps(outcomes))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
