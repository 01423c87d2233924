"""Write the tables of the virtual rig: python -m benchmarks.virtual_rig_elements."""

from benchmarks.virtual_rig_elements.tables import FOLDER, TABLES, text

if __name__ == "__main__":
    for name in TABLES:
        (FOLDER / name).write_text(text(name), "utf-8")
        print(FOLDER / name)
