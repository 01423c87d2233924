"""Speed, as ratios side by side: `make bench`, or `python -m benchmarks`."""
