"""Inference of mass, damping and stiffness from a gear that was seen to move."""
