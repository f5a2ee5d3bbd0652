"""Scripts that the tests hand to a real Blender: `blender … --python SCRIPT -- ARGUMENTS`."""
