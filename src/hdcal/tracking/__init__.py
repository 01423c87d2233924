"""Is the stiffness changing, reading by reading?"""
