"""Readings and gear file: from files to a case.

`tables` reads any source as columns of cells, `measurements` converts, checks, labels
and screens them, `gear` reads the gear file, `reading` makes a case of both. What is
wrong on the way is collected in `findings`.
"""
