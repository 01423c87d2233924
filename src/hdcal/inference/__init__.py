"""The one model, the one sampler, and the checks on what they give."""
