"""How much does the stiffness of several results differ?"""
