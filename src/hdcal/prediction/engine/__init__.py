"""The one engine for forces: whose, under which conditions, over which causes."""
