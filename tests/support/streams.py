"""Streams that are followed to their end, against the truth they were made from."""

import copy


def follow(start, at, force, stiffness: float) -> tuple[bool, list[bool], int]:
    """Follow one stream with a copy of a tracker.

    Args:
        start: the tracker.
        at: deformation of each row [mm].
        force: of each row [N].
        stiffness: the true one [N/mm].

    Returns:
        Whether its interval holds the stiffness at the end, whether each reading lay in
        its own, and the number of alarms.
    """
    mine, read, found = copy.deepcopy(start), [], {}
    for row in zip(at.tolist(), force.tolist(), strict=True):
        found = mine.update(*row)
        low, high = found["force_N"]["predictive_95"]
        read.append(low < row[1] < high)
    low, high = found["stiffness_N_per_mm"]["credible_95"]
    return low < stiffness < high, read, mine.alarms
