"""Readings and gear file: from files to a case.

`tables` makes one grid of cells of any source, and of it columns of readings.
`measurements` makes readings in code units of them, checked, labelled and screened; so
it does of a folder of tables and of batches of Parquet. `gear` reads the gear file by
the schema in `gear_file`. `reading` makes a case of both. What is wrong on the way is
collected in `findings`.
"""
