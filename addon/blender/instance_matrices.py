"""The matrices of a depsgraph's instances: all at once where that leaves no memory behind, else one by one."""

from __future__ import annotations

from array import array
from itertools import islice
from math import isfinite

import bpy
import numpy as np

from . import compat


class Matrices:
    """Object to world, of all instances in their order. To ask for all of them at once takes a third of the time, but
    before Blender 5.0 it leaves 221 bytes behind for each instance of the first object that is walked over: where that
    one has instances, they are read one by one, as whoever walks over them comes to each."""

    def __init__(self, depsgraph: bpy.types.Depsgraph) -> None:
        self.count, has_instances = _survey(depsgraph)
        self.is_by_one = has_instances and compat.keeps_memory_of_instances()
        self.world = np.zeros((self.count, 4, 4), np.float32)
        """(M, 4, 4), as far as they are read; and (M,) whether they are finite."""
        self.is_finite = np.zeros(self.count, bool)

    def read(self, depsgraph: bpy.types.Depsgraph) -> None:
        """All of them, where they can be read at once."""
        if not self.is_by_one and self.count:
            columns = np.empty((self.count, 4, 4), np.float32)
            depsgraph.object_instances.foreach_get("matrix_world", columns.ravel())
            self.world = columns.transpose(0, 2, 1)
            self.is_finite = np.isfinite(columns).all(axis=(1, 2))

    def read_one(self, place: int, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """That of one instance, which is valid now."""
        numbers = array("f")
        for row in instance.matrix_world:
            numbers.extend(row)
        self.world[place].flat = numbers
        self.is_finite[place] = isfinite(sum(numbers))


def _survey(depsgraph: bpy.types.Depsgraph) -> tuple[int, bool]:
    """How many there are, and whether the first object that is walked over has instances. The walk goes to its end,
    because Blender 4.3 never frees what it has of one that is given up."""
    instances = iter(depsgraph.object_instances)
    owner, count, has_instances = None, 0, False
    for instance in islice(instances, 2):
        count += 1
        is_of_the_first = instance.is_instance and (owner is None or instance.parent.original == owner)
        has_instances, owner = has_instances or is_of_the_first, owner or instance.object.original
    return count + sum(1 for _ in instances), has_instances
