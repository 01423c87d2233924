"""What was measured, on what, and what is believed of it.

A table goes through one file for each step: `text_file` (bytes to text), `csv_table`
(text to headers and cells), `columns` (which header is which quantity), `cells` (cells
to numbers and labels), `value_checks`; `measurements` calls them in this order. A
gear file goes through `toml_file`, `gear_schema`, `prior_entry` and `gear`. `reading`
makes a case of both. What is wrong on the way is collected in `findings`.
"""
