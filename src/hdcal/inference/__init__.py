"""The one model, the samplers, and the checks on what they give."""
