"""The record is looked at before a model is fitted: faults, sign, range, straight part.

In all modules x is the deformation and y the force of the rows of one run, in the order
in which they were taken, shape (n,) each; scatter is the sd of the deformation's
reading.
"""
