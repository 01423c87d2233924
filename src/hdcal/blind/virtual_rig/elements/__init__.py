"""The gear as finite elements: what presses back in the blind check's rig."""
