"""How every answer is shown: page, terminal, JSON and result folder."""
