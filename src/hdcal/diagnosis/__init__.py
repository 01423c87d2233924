"""Where is the sim-to-real gap, which effect causes it, how far does it shrink."""
