"""The 3D view: viser behind our own routes, one server per session."""

from app.viewer.hub import Hub

__all__ = ["Hub"]
