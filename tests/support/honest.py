"""A toy problem that Bayes' rule solves exactly, and who answers it honestly.

A gap is a direction in eight dimensions, as long as r √n; noise adds a standard normal
to each. An effect has a direction of its own, known; a cause outside the library has
any. Which hypothesis it is, and which r, follows exactly from the prior that drew them.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.special import gammaln, ive, logsumexp, softmax
from scipy.stats import chi2

from hdcal.blind.label import CaseAnswer, Label

FAMILIES = {
    "friction": "rig",
    "slack": "rig",
    "stiffening": "shape",
    "drift": "time",
    "warming": "time",
}
EFFECTS = tuple(FAMILIES)
PAIRS = ("drift+friction", "slack+stiffening")
DIMENSIONS, ROWS = 8, 144
SIZES = (0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0)
PRIOR = {"none": 0.2, "unknown": 0.15, "pair": 0.05, "effect": 0.6}
ALARM = 0.01
# Between any two of them the cosine is 0.5: alike, but not the same.
SHAPES = np.sqrt(0.5) * (np.eye(DIMENSIONS)[: len(EFFECTS)] + np.eye(DIMENSIONS)[-1])


@dataclass(frozen=True)
class Check:
    """A set of cases with honest answers to it."""

    labels: list[Label]
    answers: list[CaseAnswer]
    closures: dict[str, float]
    mixed: set[str]


@cache
def directions() -> dict[str, np.ndarray]:
    """Return the unit direction of every effect and pair."""
    own = dict(zip(EFFECTS, SHAPES, strict=True))
    for pair in PAIRS:
        both = sum(own[name] for name in pair.split("+"))
        own[pair] = both / np.linalg.norm(both)
    return own


def posterior(seen: np.ndarray, withheld: tuple[str, ...] = ()) -> dict[str, float]:
    """Return the exact probability of every hypothesis.

    Args:
        seen: gap plus noise, shape (8,).
        withheld: effects that the library lacks.
    """
    lengths = np.array(SIZES) * ROWS**0.5
    own = directions()
    cosines = np.array([*own.values()]) @ seen
    each = np.multiply.outer(lengths, cosines) - 0.5 * lengths[:, None] ** 2
    along = dict(zip(own, np.logaddexp.reduce(each), strict=True))
    prior = {"none": PRIOR["none"], "unknown": PRIOR["unknown"]}
    prior |= {name: PRIOR["pair"] / len(PAIRS) for name in PAIRS}
    prior |= {name: PRIOR["effect"] / len(EFFECTS) for name in EFFECTS}
    kept = {n: p for n, p in prior.items() if not {*n.split("+")} & {*withheld}}
    evidence = {
        name: np.log(len(lengths))
        if name == "none"
        else _anywhere(seen, lengths)
        if name == "unknown"
        else along[name]
        for name in kept
    }
    weight = softmax([np.log(kept[name]) + evidence[name] for name in kept])
    return dict(zip(kept, weight.tolist(), strict=True))


def _anywhere(seen: np.ndarray, lengths: np.ndarray) -> float:
    """Average the likelihood over all directions: a Bessel function of |seen|."""
    order = DIMENSIONS / 2.0 - 1.0
    x = lengths * np.linalg.norm(seen)
    log_mean = (
        gammaln(order + 1.0) + np.log(ive(order, x)) + x - order * np.log(x / 2.0)
    )
    return float(logsumexp(log_mean - 0.5 * lengths**2))


def reply(case: str, seen: np.ndarray, withheld: tuple[str, ...] = ()) -> CaseAnswer:
    """Return the honest answer to what was seen."""
    return worded(
        CaseAnswer(
            case=case,
            verdict="none",
            effect=None,
            second_effect=None,
            set=(),
            probabilities=posterior(seen, withheld),
            inclusion={},
            detected=bool(chi2.sf(seen @ seen, DIMENSIONS) < ALARM),
        )
    )


def worded(answer: CaseAnswer) -> CaseAnswer:
    """Return an answer with words, set and inclusion that follow its probabilities."""
    chances = answer.probabilities
    inclusion = {
        name: min(1.0, sum(p for h, p in chances.items() if name in h.split("+")))
        for name in EFFECTS
    }
    ranked, chosen, total = sorted(chances, key=lambda n: -chances[n]), [], 0.0
    for name in ranked:
        chosen += [part for part in name.split("+") if part not in chosen]
        total += chances[name]
        if total >= 0.9:
            break
    top = max(inclusion, key=lambda n: inclusion[n])
    word = "ambiguous"
    if not answer.detected or ranked[0] == "none":
        word = "none"
    elif ranked[0] == "unknown":
        word = "unknown"
    elif inclusion[top] >= 0.95:
        word = "named"
    return replace(
        answer,
        verdict=word,
        effect=top if word in ("named", "ambiguous") else None,
        set=tuple(chosen),
        inclusion=inclusion,
    )


def make_check(count: int = 1200, seed: int = 3) -> Check:
    """Return cases drawn as the prior says, and others that it does not hold."""
    rng = np.random.default_rng(seed)
    drawn = [_drawn(rng) for _ in range(count)]
    extra = [_planned(rng, place) for place in range(count // 2)]
    order = rng.permutation(len(drawn) + len(extra))
    labels, answers, closures, mixed = [], [], {}, set()
    for place, index in enumerate(order):
        case = f"case-{place:05d}"
        label = replace([*drawn, *extra][index], case=case)
        gap = np.array(label.curve[:DIMENSIONS]) * ROWS**0.5
        seen = gap + rng.normal(size=DIMENSIONS)
        answer = reply(case, seen, label.withheld)
        if index < count:
            mixed.add(case)
        if label.kind == "effect":
            closures[case] = float(rng.uniform(0.6, 0.95))
        labels.append(_finished(label, seen))
        answers.append(_sized(answer, label, seen, closures.get(case), rng))
    return Check(labels, answers, closures, mixed)


def _drawn(rng: np.random.Generator) -> Label:
    kind = str(rng.choice([*PRIOR], p=[*PRIOR.values()]))
    size = float(rng.choice(SIZES))
    if kind == "none":
        return _label("null", (), 0.0, rng)
    if kind == "unknown":
        spanned = bool(rng.random() < 0.5)
        return _label("outside", ("elsewhere",), size, rng, spanned=spanned)
    names = str(rng.choice(PAIRS if kind == "pair" else EFFECTS)).split("+")
    return _label("pair" if kind == "pair" else "effect", tuple(names), size, rng)


def _planned(rng: np.random.Generator, place: int) -> Label:
    """Return cases that the bar asks for more often than the prior."""
    name = str(rng.choice(EFFECTS))
    if place % 3 == 0:
        return _label("effect", (name,), 1.0, rng, withheld=(name,))
    if place % 3 == 1:
        return _label("effect", (name,), float(rng.choice([0.5, 1.0])), rng)
    if place % 6 == 2:
        return _with_another(_label("effect", (name,), 1.0, rng), rng)
    return _label("null", (), 0.0, rng)


def _with_another(label: Label, rng: np.random.Generator) -> Label:
    """Return the case of an effect with a tenth of its square outside beside it."""
    other = rng.normal(size=DIMENSIONS)
    other /= np.linalg.norm(other)
    curve = np.sqrt(0.9) * np.array(label.curve) + np.sqrt(0.1) * label.r * other
    kind = {"kind": "composite", "beside": "elsewhere", "share": 0.9}
    return replace(label, curve=tuple(curve.tolist()), **kind)


def _label(kind, truth, size, rng, spanned=None, withheld=()) -> Label:
    if kind == "outside":
        direction = rng.normal(size=DIMENSIONS)
    else:
        direction = directions().get("+".join(truth), np.zeros(DIMENSIONS))
    length = np.linalg.norm(direction) or 1.0
    kinds = 4 if kind == "null" else 2
    chances = np.array([0.5, 0.2, 0.15, 0.15])[:kinds]
    noise = int(rng.choice(kinds, p=chances / chances.sum()))
    return Label(
        case="",
        kind=kind,
        truth=truth,
        program=str(rng.choice(["rich", "ramp"], p=[0.7, 0.3])),
        rows=ROWS,
        r=size,
        noise=("iid", "ar", "ar", "log")[noise],
        correlation=(0.0, 0.3, 0.8, 0.95)[noise],
        sigma=1.0,
        spanned=spanned,
        withheld=withheld,
        curve=tuple((size * direction / length).tolist()),
    )


def _finished(label: Label, seen: np.ndarray) -> Label:
    if label.kind != "effect":
        return label
    size = label.r
    chances = softmax(size * ROWS**0.5 * (SHAPES @ seen))
    name = label.truth[0]
    return replace(
        label,
        amplitude={f"{name}.size": size},
        oracle=dict(zip(EFFECTS, chances.tolist(), strict=True)),
    )


def _sized(answer: CaseAnswer, label: Label, seen, closure, rng) -> CaseAnswer:
    own = directions()
    sd = ROWS**-0.5
    if answer.effect is not None:
        size = float(seen @ own[answer.effect]) * sd
        found = (size, size - 1.96 * sd, size + 1.96 * sd)
        answer = replace(answer, amplitude={f"{answer.effect}.size": found})
    size = float(np.sqrt(np.mean(np.square(label.curve or 0.0))))
    size += float(rng.normal(0.0, 0.02))
    answer = replace(answer, gap=(size, size - 0.039, size + 0.039))
    if closure is not None:
        share = closure + float(rng.normal(0.0, 0.04))
        answer = replace(answer, closed=(share, share - 0.08, share + 0.08))
    return answer
