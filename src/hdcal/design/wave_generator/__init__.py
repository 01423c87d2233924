"""Which spring of an elastic wave generator keeps a gear inside a window?"""
