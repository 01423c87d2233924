"""Answers about a gear that moves: its calibration and its response to a force."""
