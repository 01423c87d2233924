"""Cases are scored in processes of their own, which share compiled programs."""

import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

from benchmarks.diagnosis.score import Task, score


def run(tasks: list[Task], seed: int, processes: int) -> list[dict]:
    """Score every task; the rows come in the order of the tasks."""
    rows = []
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        for row in pool.map(partial(score, seed=seed), tasks, chunksize=4):
            rows.append(row)
            if len(rows) % 20 == 0:
                print(f"\r{len(rows)} of {len(tasks)}", end="", file=sys.stderr)
    print(file=sys.stderr)
    return rows
