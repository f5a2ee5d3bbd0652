"""Instances of trees."""

from ._bihtree import Scene

__all__ = ["Scene"]
