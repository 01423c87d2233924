"""The virtual rig's ring and cup as finite elements; they make its tables."""
