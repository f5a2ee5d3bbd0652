"""BIH for Blender: the rooms without Blender import without it; only register() reaches for bpy."""


def register() -> None:
    from .blender import registration

    registration.register()


def unregister() -> None:
    from .blender import registration

    registration.unregister()
