"""Do intervals and bounds of the force hold on rigs whose curves are not straight?

    python -m benchmarks.bounds make FOLDER --count 300 --seed 1
    PYTHONPATH=. OTHER/python -m benchmarks.bounds answer FOLDER NAME
    python -m benchmarks.bounds score FOLDER NAME...

A rig of the blind check with a mechanism that leaves a gap of r noise sds, or none, is
tested on a ramp: one gear, gears in one mounting each, or mountings of one gear. Asked
are the mean, one member and the bound 90/95 inside and beyond the tested deformation.
`answer` uses the public functions of hdcal only, so that other versions answer too.
"""

import argparse
import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from benchmarks.blind.rig.history import History
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.virtual_rig import draw_rig

# Largest tested deformation [mm]; places in multiples of it.
TESTED = 0.27
TIMES = (0.5, 0.9, 1.0, 1.0001, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0)
KINDS = ("readings", "mountings", "specimens")
# Sds of the members: zeros of mountings [N], stiffness of gears relative.
ZERO_SD, GEAR_SD = 0.8, 0.03
# Enough draws for an interval of 95 %.
SAMPLED = {"chains": 2, "warmup": 500, "draws": 1500}
# Of one size, as every other one is compiled anew.
MEMBERS, ROWS = 5, 12
CONTENT, CONFIDENCE = 0.9, 0.95
# Tested and other temperature [°C]; sds of the drift of the zero [N/K] and the frame
# [mm/K], as the shipped priors have them.
COLD, WARM = 20.0, 80.0
DRIFTS = (0.1, 1e-3)
# An immediate prediction has no part in what time alone brings.
OF_TIME = ("charge_leakage", "amplifier_drift")
GEAR = """[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"
"""


def ramp(deformation: np.ndarray, temperature: float = COLD) -> History:
    """Return a ramp from rest."""
    count = len(deformation)
    none, one = np.zeros(count, dtype=int), np.ones(count)
    return History(
        deformation=deformation,
        temperature=temperature * one,
        time=2.0 * np.arange(count),
        angle=np.linspace(0.0, 2.0 * np.pi, count),
        direction=one,
        sense=one,
        cycle=none,
        run=none,
        specimen=none,
        force=0.0 * one,
    )


def draw_case(kind: str, rng: np.random.Generator) -> tuple[str, dict] | None:
    """Return a table of readings and the truth; None where no size leaves the gap."""
    members, rows = (1, 30) if kind == "readings" else (MEMBERS, ROWS)
    along = np.linspace(0.02, TESTED, rows)
    names = [name for name in MECHANISMS if name not in OF_TIME]
    name, r = str(rng.choice(names)), float(rng.choice([0.0, 0.5, 1.0, 2.0]))
    rig = draw_rig(ramp(along), rng)
    active = []
    if r > 0.0:
        drawn = rig.draw_mechanism(MECHANISMS[name], r, rng)
        if drawn is None:
            return None
        active = [drawn]
    zeros = ZERO_SD * rng.normal(size=members) * (kind == "mountings")
    gears = 1.0 + GEAR_SD * rng.normal(size=members) * (kind == "specimens")
    curve = rig.readings(active) - rig.zero
    lines = ["specimen,run,deformation_mm,force_N"]
    for member in range(members):
        force = rig.zero + zeros[member] + gears[member] * curve
        force = force + rig.sigma * rng.normal(size=rows)
        label = f"{member},1" if kind == "specimens" else f"0,{member}"
        lines += [f"{label},{x:.5f},{f:.4f}" for x, f in zip(along, force, strict=True)]
    spread = {"readings": 0.0, "mountings": ZERO_SD, "specimens": GEAR_SD}[kind]
    mean = []
    for times in TIMES:
        path = np.append(along[along < times * TESTED], times * TESTED)
        mean.append(replace(rig, history=ramp(path)).readings(active)[-1])
    warm = replace(rig, history=ramp(np.append(along, TESTED)[-1:], WARM))
    drift = (WARM - COLD) * rng.normal(0.0, DRIFTS) @ (1.0, rig.stiffness)
    return "\n".join(lines) + "\n", {
        "kind": kind,
        "members": members,
        "r": r,
        "mechanism": name if active else "none",
        "with_gap": bool(rng.random() < 0.5),
        "zero": rig.zero,
        "sigma": rig.sigma,
        "spread": spread,
        "mean": mean,
        "score": float(rng.normal()),
        "hot": float(warm.readings(active)[-1] + drift),
    }


def make(folder: Path, count: int, seed: int) -> None:
    """Write tables and truths of so many rigs, the kinds by turns."""
    folder.mkdir(parents=True)
    (folder / "gear.toml").write_text(GEAR)
    rng, truths = np.random.default_rng(seed), {}
    while len(truths) < count:
        found = draw_case(KINDS[len(truths) % len(KINDS)], rng)
        if found is not None:
            name = f"rig{len(truths):04d}"
            (folder / f"{name}.csv").write_text(found[0])
            truths[name] = found[1]
    (folder / "truth.json").write_text(json.dumps(truths, indent=1))


def answer(folder: Path, name: str) -> None:
    """Answer all rigs of a folder with the installed hdcal; go on where it ended."""
    import hdcal

    truths = json.loads((folder / "truth.json").read_text())
    file = folder / f"{name}.jsonl"
    done = {json.loads(line)["rig"] for line in _lines(file)}
    for rig in [rig for rig in truths if rig not in done]:
        told = {"rig": rig, "levels": []}
        try:
            case = hdcal.read_case(folder / f"{rig}.csv", folder / "gear.toml")
            asked = {"content": CONTENT, "confidence": CONFIDENCE}
            asked |= {"population": truths[rig]["kind"]}
            gap = truths[rig]["with_gap"]
            posterior = hdcal.calibrate(case, with_gap=gap, **SAMPLED)
            places = [(times * TESTED, COLD) for times in TIMES] + [(TESTED, WARM)]
            for at, warm in places:
                one = hdcal.margin(posterior, at, temperature=warm, **asked).worst
                mean, member = one.force_N, one.member_N
                bounds = one.lower_bound_N, one.upper_bound_N
                row = (mean.lo, mean.hi, member.lo, member.hi, *bounds)
                told["levels"].append(row)
        except (hdcal.HdcalError, ValueError) as error:
            told["failed"] = str(error)[:300]
        with file.open("a") as out:
            out.write(json.dumps(told) + "\n")


def _lines(file: Path) -> list[str]:
    return file.read_text().splitlines() if file.is_file() else []


def score(folder: Path, names: list[str]) -> None:
    """Print the share of rigs that each promise holds, as Markdown."""
    truths = json.loads((folder / "truth.json").read_text())
    print("| answers | promise | rigs |", *(f" {t:g} × |" for t in TIMES), "80 °C |")
    print("|---|---|---:|" + "---:|" * (len(TIMES) + 1))
    for name in names:
        held = defaultdict(list)
        told = [json.loads(line) for line in _lines(folder / f"{name}.jsonl")]
        failed = [one["rig"] for one in told if len(one["levels"]) <= len(TIMES)]
        for one in told:
            if one["rig"] not in failed:
                _hold(truths[one["rig"]], np.array(one["levels"]), held)
        for promise in sorted(held):
            shares = np.mean(held[promise], axis=0)
            cells = " | ".join(f"{100.0 * share:.0f}" for share in shares)
            print(f"| {name} | {promise} | {len(held[promise])} | {cells} |")
        print(f"| {name} | without an answer | {len(failed)} |")


def _hold(truth: dict, levels: np.ndarray, held: dict) -> None:
    mean = np.array([*truth["mean"], truth["hot"]])
    load = mean - truth["zero"]
    kind, spread = truth["kind"], truth["spread"]
    scatter = spread * load if kind == "specimens" else spread
    sd = np.hypot(truth["sigma"], scatter)
    member = mean + sd * truth["score"]
    outer = mean + sd * ndtri(CONTENT)
    low, high, least, most, _, upper = levels.T
    for group in ("all", "fitted discrepancy" if truth["with_gap"] else "line"):
        held[f"mean, {group}"].append((low <= mean) & (mean <= high))
    held[f"mean, {kind}"].append((low <= mean) & (mean <= high))
    held[f"mean, r = {truth['r']:g}"].append((low <= mean) & (mean <= high))
    held[f"one member, {kind}"].append((least <= member) & (member <= most))
    held[f"bound, {kind}"].append(outer <= upper)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="benchmarks.bounds")
    parser.add_argument("step", choices=["make", "answer", "score"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    if given.step == "make":
        make(given.folder, given.count, given.seed)
    elif given.step == "answer":
        answer(given.folder, given.names[0])
    else:
        score(given.folder, given.names)


if __name__ == "__main__":
    main()
