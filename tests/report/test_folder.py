"""A result folder appears whole or not at all."""

from pathlib import Path

import pytest

from hdcal.errors import InputError
from hdcal.report.folder import check_target, whole_folder, write_whole


def names(folder: Path) -> list[str]:
    """Return everything below a folder."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_nothing_is_seen_before_the_end(tmp_path: Path):
    with whole_folder(tmp_path / "run") as building:
        (building / "summary.json").write_text("{}")
        assert not (tmp_path / "run").exists()
    assert names(tmp_path) == ["run", "run/summary.json"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failure_leaves_nothing(error: type[BaseException], tmp_path: Path):
    with pytest.raises(error), whole_folder(tmp_path / "run") as building:
        (building / "summary.json").write_text("{}")
        raise error
    assert names(tmp_path) == []


def test_a_failure_leaves_the_older_result(tmp_path: Path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "summary.json").write_text("old")
    with (
        pytest.raises(InputError, match="No space left"),
        whole_folder(tmp_path / "run", force=True) as building,
    ):
        (building / "summary.json").write_text("new")
        raise OSError(28, "No space left on device")
    assert names(tmp_path) == ["run", "run/summary.json"]
    assert (tmp_path / "run" / "summary.json").read_text() == "old"


def test_force_replaces_the_whole_folder(tmp_path: Path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "verdict.json").write_text("old")
    with whole_folder(tmp_path / "run", force=True) as building:
        (building / "summary.json").write_text("new")
    assert names(tmp_path) == ["run", "run/summary.json"]


def test_force_never_removes_what_hdcal_did_not_write(tmp_path: Path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.txt").write_text("years of work")
    with pytest.raises(InputError, match=r"'thesis\.txt'"):
        check_target(tmp_path / "run", force=True)
    (tmp_path / "run" / "thesis.txt").rename(tmp_path / "run" / "report.html")
    (tmp_path / "run" / "posterior.nc").mkdir()
    with pytest.raises(InputError, match=r"'posterior\.nc'"):
        check_target(tmp_path / "run", force=True)


def test_a_link_is_followed(tmp_path: Path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there" / "run")
    with whole_folder(tmp_path / "link"):
        pass
    assert names(tmp_path) == ["link", "there", "there/run"]


def test_a_checked_target_is_left_alone(tmp_path: Path):
    check_target(tmp_path / "run")
    assert names(tmp_path) == []
    with pytest.raises(InputError, match="exists already"):
        check_target(tmp_path)
    with pytest.raises(InputError, match="parent folder does not exist"):
        check_target(tmp_path / "none" / "run")


def test_a_file_is_written_whole(tmp_path: Path):
    target = tmp_path / "bands.csv"
    write_whole(target, "a\n")
    with pytest.raises(InputError, match="exists already"):
        write_whole(target, "b\n")
    assert target.read_text() == "a\n"
    write_whole(target, "b\n", force=True)
    assert target.read_text() == "b\n"
    with pytest.raises(InputError, match="is a folder"):
        write_whole(tmp_path, "c\n", force=True)
    assert names(tmp_path) == ["bands.csv"]
