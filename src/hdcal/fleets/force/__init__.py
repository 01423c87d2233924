"""What force will gears to come of a fleet need?"""
