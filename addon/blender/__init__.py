"""The only rooms that know Blender: a scene is read here once, and a picture is given back here once."""
