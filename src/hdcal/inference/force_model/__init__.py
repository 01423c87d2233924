"""The force model as a problem of inference: noise, members, discrepancy."""
