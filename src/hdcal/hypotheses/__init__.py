"""Marginal likelihoods of all hypotheses of a case, and the decision they support."""
