"""How much force: the one engine behind every answer about forces."""
