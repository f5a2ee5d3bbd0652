"""bihtree beside its peers: `python -m benchmarks`."""
