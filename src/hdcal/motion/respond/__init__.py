"""How does a calibrated gear move under a force?"""
