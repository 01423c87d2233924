"""Which sizes keep a limit of the force?"""
