"""Many gears: which one is off, and how much do they scatter?"""
