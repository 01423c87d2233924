"""How stiff is this gear, and how sure is that?"""
