"""The virtual rig of the blind check: other physics than the library's."""
