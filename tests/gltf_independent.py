"""What a GLB looks like at a time, evaluated straight from the specification with 4 x 4 matrices.

Knows nothing of sixpoint: its own parsing, SciPy's interpolation. LINEAR animation, nodes, skins.
"""

from __future__ import annotations

import json
import struct

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

DTYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Scene:
    """A GLB.

    Args:
        data: Its bytes.
    """

    def __init__(self, data: bytes) -> None:
        length = struct.unpack_from("<I", data, 12)[0]
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[28 + length :]

    def accessor(self, index: int) -> np.ndarray:
        """The numbers of an accessor, a row per element."""
        entry = self.json["accessors"][index]
        view = self.json["bufferViews"][entry["bufferView"]]
        dtype = np.dtype(DTYPES[entry["componentType"]])
        width = WIDTHS[entry["type"]]
        stride = view.get("byteStride", dtype.itemsize * width)
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        rows = [
            np.frombuffer(self.binary, dtype, width, start + stride * k).astype(float)
            for k in range(entry["count"])
        ]
        scale = np.iinfo(dtype).max if entry.get("normalized") else 1.0
        return np.array(rows) / scale

    def locals_at(self, time: float) -> list[np.ndarray]:
        """Local matrices of all nodes."""
        parts = []
        for node in self.json["nodes"]:
            if "matrix" in node:
                parts.append(np.array(node["matrix"], float).reshape(4, 4).T)
            else:
                keys = (("translation", [0, 0, 0]), ("rotation", [0, 0, 0, 1]), ("scale", [1, 1, 1]))
                parts.append({key: np.array(node.get(key, default), float) for key, default in keys})
        for animation in self.json.get("animations", [])[:1]:
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                times, values = self.accessor(sampler["input"])[:, 0], self.accessor(sampler["output"])
                now = float(np.clip(time, times[0], times[-1]))
                if len(times) == 1:
                    value = values[0]
                elif channel["target"]["path"] == "rotation":
                    value = Slerp(times, Rotation.from_quat(values))(now).as_quat()
                else:
                    value = np.array([np.interp(now, times, column) for column in values.T])
                parts[channel["target"]["node"]][channel["target"]["path"]] = value
        matrices = []
        for part in parts:
            if isinstance(part, dict):
                matrix = np.eye(4)
                matrix[:3, :3] = Rotation.from_quat(part["rotation"]).as_matrix() * part["scale"]
                matrix[:3, 3] = part["translation"]
                part = matrix
            matrices.append(part)
        return matrices

    def world_at(self, time: float) -> np.ndarray:
        """World matrices (N, 4, 4) of all nodes."""
        local = self.locals_at(time)
        world = np.tile(np.eye(4), (len(local), 1, 1))
        stack = [(n, np.eye(4)) for n in self.json["scenes"][self.json.get("scene", 0)]["nodes"]]
        while stack:
            node, above = stack.pop()
            world[node] = above @ local[node]
            stack += [(child, world[node]) for child in self.json["nodes"][node].get("children", [])]
        return world

    def vertices_at(self, time: float) -> np.ndarray:
        """Corners (T, 3, 3) of all triangles, in the order of nodes and primitives."""
        world = self.world_at(time)
        found = []
        for k, node in enumerate(self.json["nodes"]):
            for primitive in self.json["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
                attributes = primitive["attributes"]
                points = self.accessor(attributes["POSITION"])
                points = np.column_stack([points, np.ones(len(points))])
                if "skin" in node:
                    skin = self.json["skins"][node["skin"]]
                    inverse = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
                    palette = world[skin["joints"]] @ inverse
                    joints = self.accessor(attributes["JOINTS_0"]).astype(int)
                    weights = self.accessor(attributes["WEIGHTS_0"])
                    placed = np.einsum("vk,vkij,vj->vi", weights, palette[joints], points)
                else:
                    placed = points @ world[k].T
                order = self.accessor(primitive["indices"])[:, 0].astype(int)
                found.append(placed[order, :3].reshape(-1, 3, 3))
        return np.concatenate(found)
