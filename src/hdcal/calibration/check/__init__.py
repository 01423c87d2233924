"""Can this case be read?"""
