"""Which force does a deformation need, and does it keep a limit?"""
