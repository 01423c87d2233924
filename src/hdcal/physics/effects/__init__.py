"""Effects by kind."""
