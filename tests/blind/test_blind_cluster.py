"""A Dask cluster answers a blind check: nothing is lost, nothing comes twice."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from clusters import local_cluster
from commands import Hdcal
from sealing import by_library, deadly, sealed_set, slowly

from hdcal.blind.answering import answer_set
from hdcal.blind.diagnosers import DIAGNOSERS
from hdcal.cli import cluster
from hdcal.errors import HdcalError, InputError

distributed = pytest.importorskip("distributed")


def cases_of(folder: Path) -> list[str]:
    """Return the cases that are answered one by one."""
    return sorted(path.stem for path in folder.glob("answers-*/*.json"))


@pytest.mark.thorough
def test_a_killed_worker_loses_nothing_and_doubles_nothing(local, tmp_path: Path):
    folder = sealed_set(tmp_path / "set", 10)
    alone = sealed_set(tmp_path / "alone", 10)
    told: list[int] = []
    killed: list[int] = []

    def tell(done: int, _: int) -> None:
        told.append(done)
        assert len(cases_of(folder)) == done
        if done == 2:
            process = local.workers[0].process
            killed.append(process.pid)
            os.kill(process.pid, signal.SIGKILL)

    work = {"diagnosers": {"slow": slowly}, "by": "slow"}
    data = answer_set(folder, scheduler=local.scheduler_address, progress=tell, **work)
    assert killed and told == list(range(1, 11))
    names = [f"c{index:02d}" for index in range(1, 11)]
    assert [one["case"] for one in data["answers"]] == names == cases_of(folder)
    expected = answer_set(alone, diagnosers={"a": by_library}, by="a")["answers"]
    assert data["answers"] == expected


@pytest.mark.thorough
def test_what_kills_every_worker_ends_the_run(local, tmp_path: Path):
    folder = sealed_set(tmp_path / "set", 2)
    with pytest.raises(HdcalError, match=r"several workers .* again to go on"):
        answer_set(
            folder,
            diagnosers={"deadly": deadly},
            by="deadly",
            scheduler=local.scheduler_address,
        )
    assert not cases_of(folder) and not (folder / "answers-deadly.json").exists()


@pytest.mark.thorough
def test_a_lost_scheduler_is_one_line_and_costs_no_answer(
    here: Hdcal, monkeypatch, tmp_path: Path
):
    where = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    begin = [sys.executable, "-m", "dask"]
    own = ["--no-dashboard", "--scheduler-file", str(where)]
    with (
        begun([*begin, "scheduler", "--port", "0", *own], quiet) as scheduler,
        begun([*begin, "worker", "--nthreads", "1", *own], quiet),
    ):
        # It is there before it is written.
        until(lambda: where.exists() and bool(where.read_text()))
        address = json.loads(where.read_text())["address"]
        folder = sealed_set(tmp_path / "set", 40)
        monkeypatch.setitem(DIAGNOSERS, "slow", slowly)

        def kill() -> None:
            until(lambda: bool(cases_of(folder)))
            scheduler.kill()

        killer = threading.Thread(target=kill)
        killer.start()
        done = here("blind", "answer", folder, "--by", "slow", "--scheduler", address)
        killer.join()
    assert done.returncode == 1, done.stderr
    assert "the scheduler went away; what was answered is kept" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    kept = cases_of(folder)
    assert kept and len(kept) < 40
    data = answer_set(folder, diagnosers={"slow": by_library}, by="slow")
    assert len(data["answers"]) == 40


@contextmanager
def begun(command: list[str], quiet: dict) -> Iterator[subprocess.Popen]:
    """Run a process until the end of the block."""
    paths = os.pathsep.join(path for path in sys.path if path)
    with subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": paths}, **quiet
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


def until(happened: Callable[[], bool]) -> None:
    """Wait until something has happened, but not for ever."""
    for _ in range(1200):
        if happened():
            return
        time.sleep(0.05)


@pytest.mark.thorough
def test_the_real_diagnosis_answers_there(local, here: Hdcal, tmp_path: Path):
    folder = sealed_set(tmp_path / "set", 1)
    asked = ["blind", "answer", folder, "--scheduler", local.scheduler_address]
    done = here(*asked, "--json")
    assert done.returncode == 0, done.stderr
    assert len(done.stderr.splitlines()) == 2
    (answer,) = json.loads(done.stdout)["answers"]
    assert answer["case"] == "c01" and answer["p_value"] is not None
    assert cases_of(folder) == ["c01"]


@pytest.mark.thorough
def test_workers_of_another_version_are_refused(local, monkeypatch, tmp_path: Path):
    from hdcal.blind import answering

    made_by = answering.fingerprint()
    monkeypatch.setattr(
        answering, "fingerprint", lambda _: {**made_by, "code_sha256": "0"}
    )
    folder = sealed_set(tmp_path / "set", 2)
    with pytest.raises(InputError, match="mixed versions: a worker runs other code"):
        answer_set(
            folder,
            diagnosers={"a": by_library},
            by="a",
            scheduler=local.scheduler_address,
        )
    assert not cases_of(folder)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "nowhere"])
def test_a_scheduler_that_does_not_answer_is_one_line(
    here: Hdcal, monkeypatch, tmp_path: Path, address: str
):
    monkeypatch.setattr(cluster, "_SECONDS_TO_ANSWER", 1)
    folder = sealed_set(tmp_path / "set", 1)
    done = here("blind", "answer", folder, "--by", "none", "--scheduler", address)
    assert done.returncode == 2 and not done.stdout
    assert len(done.stderr.splitlines()) == 1
    assert f"--scheduler: no scheduler answers at '{address}'" in done.stderr
    assert not cases_of(folder)


def test_a_scheduler_without_workers_is_one_line(monkeypatch, tmp_path: Path):
    monkeypatch.setattr(cluster, "_SECONDS_FOR_A_WORKER", 1)
    folder = sealed_set(tmp_path / "set", 1)
    with (
        local_cluster(n_workers=0, dashboard_address=":0", silence_logs=50) as empty,
        pytest.raises(InputError, match="has no workers"),
    ):
        answer_set(folder, scheduler=empty.scheduler_address)


def test_without_dask_it_says_what_to_install(here: Hdcal, monkeypatch, tmp_path: Path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    folder = sealed_set(tmp_path / "set", 1)
    asked = ["--by", "none", "--scheduler", "tcp://127.0.0.1:9"]
    done = here("blind", "answer", folder, *asked)
    assert done.returncode == 2
    assert "Install hdcal[cluster]" in done.stderr
    assert len(done.stderr.splitlines()) == 1
