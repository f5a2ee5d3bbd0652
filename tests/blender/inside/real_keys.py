"""A key that comes from the X server: a render job ends by Esc only where the system itself sends it, and a simulated
event does not reach it."""

from __future__ import annotations

import ctypes

KEY_PRESS, KEY_RELEASE = 2, 3
ESCAPE = 0xFF1B


class KeyEvent(ctypes.Structure):
    """XKeyEvent of Xlib.h."""

    _fields_ = (
        *[("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int)],
        *[("display", ctypes.c_void_p)],
        *[(name, ctypes.c_ulong) for name in ("window", "root", "subwindow", "time")],
        *[(name, ctypes.c_int) for name in ("x", "y", "x_root", "y_root")],
        *[("state", ctypes.c_uint), ("keycode", ctypes.c_uint), ("same_screen", ctypes.c_int)],
        ("pad", ctypes.c_long * 24),
    )


def press(symbol: int) -> None:
    """Down and up, to the window that has the focus."""
    x = ctypes.CDLL("libX11.so.6")
    x.XOpenDisplay.restype = ctypes.c_void_p
    x.XDefaultRootWindow.restype = ctypes.c_ulong
    display = ctypes.c_void_p(x.XOpenDisplay(None))
    assert display, "no X server"
    focus, revert = ctypes.c_ulong(), ctypes.c_int()
    x.XGetInputFocus(display, ctypes.byref(focus), ctypes.byref(revert))
    keycode = x.XKeysymToKeycode(display, ctypes.c_ulong(symbol))
    root = x.XDefaultRootWindow(display)
    for kind in (KEY_PRESS, KEY_RELEASE):
        event = KeyEvent(type=kind, display=display, window=focus.value, root=root, keycode=keycode, same_screen=1)
        assert x.XSendEvent(display, focus, 0, ctypes.c_long(kind - 1), ctypes.byref(event))
    x.XCloseDisplay(display)
