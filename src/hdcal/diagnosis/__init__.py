"""Diagnosis: where model and readings part, which effect causes it, and how far."""
