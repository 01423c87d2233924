"""Finished results side by side: how they differ, and how surely."""
