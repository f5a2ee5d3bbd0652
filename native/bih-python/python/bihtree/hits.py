"""The answers to a batch of rays."""

from ._bihtree import HitLists, Hits

__all__ = ["HitLists", "Hits"]
