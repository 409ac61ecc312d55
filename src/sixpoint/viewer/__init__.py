"""A page in the browser that shows what it is given and reports what is dragged; knows no solver and no file.

``open_server`` listens, ``Scene`` holds bodies, handles and obstacles, ``Panel`` the controls. All of them
may be driven from any thread. Reports come as calls ``report(name, value)`` on the server's thread and must
return at once. Every browser that has the page open sees, and may change, the same things.
"""

from sixpoint.viewer.panel import Choice, Panel, Setting
from sixpoint.viewer.scene import Report, Scene
from sixpoint.viewer.server import describe_address, open_server

__all__ = ["Choice", "Panel", "Report", "Scene", "Setting", "describe_address", "open_server"]
