"""Which force, at these deformations?"""
