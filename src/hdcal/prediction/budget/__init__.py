"""An uncertainty budget of any model: linear, and by Monte Carlo to check it."""
