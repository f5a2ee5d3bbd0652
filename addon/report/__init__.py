"""What reports and benchmarks are made of, without Blender."""
