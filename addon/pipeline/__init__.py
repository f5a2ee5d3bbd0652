"""The main job without Blender: scene data in, pictures and a report out."""
