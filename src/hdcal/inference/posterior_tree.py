"""What a posterior file holds, collected in ArviZ' groups."""

from collections.abc import Mapping

import jax
import numpy as np

from hdcal.data.case import Case
from hdcal.exported import jit
from hdcal.inference import posterior_file
from hdcal.inference.array_tree import ArrayTree, group_of
from hdcal.inference.density import densities, pointwise_log_likelihood
from hdcal.inference.discrepancy import discrepancy_columns
from hdcal.inference.padding import pad_records
from hdcal.inference.problem import Problem
from hdcal.inference.sample import Draws
from hdcal.inference.serial_correlation import previous_rows

# Above this many numbers the log likelihood of every row and draw is not kept.
MOST_LOG_LIKELIHOODS = 8_000_000
TOTAL = "total"
_ROW = "row"
# Of what has more axes than chain and draw.
_AXES = {
    "run_offset": ("run_label",),
    "specimen_deviation": ("specimen_label",),
    "gap_weights": ("basis",),
}


def build_tree(
    case: Case,
    draws: Draws,
    prior_draws: Mapping[str, np.ndarray],
    log_likelihood: Mapping[str, np.ndarray],
    observed: tuple[str, ...] = ("force",),
) -> ArrayTree:
    """Collect everything in ArviZ' groups.

    Args:
        case: data and gear.
        draws: from the sampler.
        prior_draws: by parameter, each (draw,).
        log_likelihood: by observed column, (chain, draw, row), or the total of all
            rows under `TOTAL`, (chain, draw).
        observed: columns of the records that the model explains.
    """
    rows = {name: np.asarray(getattr(case.records, name)) for name in observed}
    over_rows = dict.fromkeys(observed, (_ROW,))
    labels = {"run_label": case.run_labels, "specimen_label": case.specimen_labels}
    likelihood = group_of(log_likelihood, axes=over_rows)
    if TOTAL in likelihood:
        size = log_likelihood[TOTAL].size * len(case.records.force)
        words = (
            f"{size} values by row and draw are not kept; this is the log likelihood "
            "of all rows, runs, specimens and gap integrated out where they were"
        )
        likelihood[TOTAL] = likelihood[TOTAL]._replace(said={"comment": words})
    return ArrayTree(
        {
            "posterior": group_of(draws.values, axes=_AXES, labels=labels),
            "prior": group_of({name: v[None] for name, v in prior_draws.items()}),
            "sample_stats": group_of(_sampler_statistics(draws)),
            "observed_data": group_of(rows, (_ROW,)),
            "constant_data": group_of(posterior_file.covariates(case.records), (_ROW,)),
            "log_likelihood": likelihood,
        }
    )


def force_log_likelihood(
    case: Case, problem: Problem, draws: Draws
) -> dict[str, np.ndarray]:
    """Return the log likelihood of each row and draw, or the totals if they are many.

    Args:
        case: data and gear.
        problem: what was sampled.
        draws: from the sampler.
    """
    rows = len(case.records.force)
    if draws.energy.size * rows > MOST_LOG_LIKELIHOODS:
        return {TOTAL: densities(problem, draws.values)[1]}
    padded = pad_records(case.records)
    columns = discrepancy_columns(problem.discrepancy, padded)
    before = np.full(len(padded.force), -1)
    before[:rows] = previous_rows(case.records)
    each = _pointwise(problem, draws.values, padded, columns, before)
    return {"force": np.asarray(each)[..., :rows]}


@jit
def _pointwise(problem, values, records, columns, before):
    def one(value):
        return pointwise_log_likelihood(problem, value, records, columns, before)

    return jax.vmap(jax.vmap(one))(values)


def _sampler_statistics(draws: Draws) -> dict[str, np.ndarray]:
    """Return what ArviZ wants to know of the sampler, (chain, draw) each."""
    return {
        "energy": draws.energy,
        "lp": -draws.potential,
        "diverging": draws.diverging,
        "n_steps": draws.n_steps,
        "tree_depth": np.ceil(np.log2(draws.n_steps + 1)).astype(int),
        "acceptance_rate": draws.acceptance,
        "step_size": draws.step_size,
    }
