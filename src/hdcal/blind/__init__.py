"""The blind check: data by other physics than the library's, sealed and scored."""
