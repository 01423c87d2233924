"""How often a diagnosis is right, on made-up data whose cause is known."""
