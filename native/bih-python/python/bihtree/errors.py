"""The errors of bihtree; their messages name the argument, the row and the value."""


class BihError(Exception):
    """Base of every error of bihtree."""


class GeometryError(BihError, ValueError):
    """A shape, a dtype or an index that cannot be used."""


class FileFormatError(BihError, ValueError):
    """A saved tree that is not one, or that is damaged."""


class Cancelled(BihError):
    """The progress callback returned False."""
