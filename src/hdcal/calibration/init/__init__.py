"""Begin a case: a folder with a gear file, and with readings where there are any."""
