"""What a person sees: figures, the report, result folders and the command line."""
