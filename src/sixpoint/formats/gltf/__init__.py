"""glTF 2.0, GLB and VRM avatars: read, driven, written.

- ``document.py``, ``schema.py``, ``accessors.py``: a file as checked JSON and arrays.
- ``nodes.py``, ``rig.py``, ``binding.py``, ``mesh.py``, ``humanoid.py``, ``appearance.py``: what it
  means for a body.
- ``avatar.py``: a file as a Figure with a Shape; ``animation.py``: its movement.
- ``builder.py``, ``keys.py``, ``write_avatar.py``, ``write_figure.py``, ``vrma.py``: the way back.
"""
