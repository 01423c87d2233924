"""What force does a deformation need, for how many of whom, how surely?"""
