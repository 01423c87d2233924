"""Which sizes, which spring?"""
