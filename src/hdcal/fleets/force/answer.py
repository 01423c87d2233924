"""The JSON answer of a margin that is asked of a fleet."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.fleets.next_force import NextForce
from hdcal.report.answer import Answer, Count, Digest, Promise, Sentences, Words


@dataclass(frozen=True, kw_only=True, repr=False)
class ForceAnswer(NextForce, Answer):
    """What `hdcal margin` answers of a fleet; next_force.json.

    Attributes:
        answer: the answer in sentences.
        notes: that the fleet was told with.
        interval: probability that every interval holds.
        fleet: name of its data.
        gears: how many were measured.
        rows: readings of all of them.
        seed: of the draws.
        versions: of the packages that made the draws.
        data_sha256: of the data.
    """

    schema: Literal["hdcal.next-force/1"] = "hdcal.next-force/1"
    status: Literal["ok"] = "ok"
    answer: Sentences
    notes: Sentences
    interval: Annotated[float, Promise(exclusiveMinimum=0, exclusiveMaximum=1)]
    fleet: Words
    gears: Count
    rows: Count
    seed: Count
    versions: Annotated[dict[str, str], Promise(required=["hdcal"])]
    data_sha256: Digest
