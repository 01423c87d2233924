"""How does the force depend on the sizes?"""
