"""The record before a model is fitted: segments, jumps, wild readings, range."""
