"""Materials and textures baked to one colour per vertex.

Base colour factor times base colour texture (bilinear, at the vertex) times vertex colour; what needs light
or a view (metal, normal maps, toon shading) is left out. An image that cannot be decoded is said and counts
as white.

Reference: Khronos, glTF 2.0 specification, section 3.9 (materials), 3.8 (textures); KHR_texture_transform.
"""

from __future__ import annotations

import io
import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.surface.appearance import Appearance
from sixpoint.formats.gltf.accessors import read_floats
from sixpoint.formats.gltf.document import Document
from sixpoint.formats.gltf.mesh import Piece

Array = NDArray[np.float64]

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648
MOST_PIXELS = 64_000_000


def bake_appearance(document: Document, pieces: list[Piece]) -> Appearance:
    """Colours of the vertices of all pieces, in their order."""
    textures: dict[int, Array | None] = {}
    return Appearance(np.concatenate([_bake(document, piece, textures) for piece in pieces]))


def _bake(document: Document, piece: Piece, textures: dict[int, Array | None]) -> Array:
    attributes = piece.primitive["attributes"]
    colours = np.ones((len(piece.used), 4))
    if "material" in piece.primitive:
        material = document.items("materials")[piece.primitive["material"]]
        surface = material.get("pbrMetallicRoughness", {})
        colours *= surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        reference = surface.get("baseColorTexture")
        image = None if reference is None else _texture(document, reference["index"], textures)
        if reference is not None and image is not None:
            uv = _read_uv(document, piece, reference)
            if uv is not None:
                sampler = document.items("textures")[reference["index"]].get("sampler")
                wrap = {} if sampler is None else document.items("samplers")[sampler]
                colours *= _sample(image, uv, wrap)
    if "COLOR_0" in attributes:
        kind = document.items("accessors")[attributes["COLOR_0"]]["type"]
        shade = read_floats(document, attributes["COLOR_0"], kind, f"COLOR_0 of {piece.label}")
        if len(shade) > piece.used.max() and shade.shape[1] in (3, 4):
            colours[:, : shade.shape[1]] *= shade[piece.used]
    return np.clip(colours, 0.0, 1.0)


def _read_uv(document: Document, piece: Piece, reference: dict[str, Any]) -> Array | None:
    """Texture coordinates (n, 2) of a piece; None where it has none."""
    change = reference.get("extensions", {}).get("KHR_texture_transform", {})
    name = f"TEXCOORD_{change.get('texCoord', reference.get('texCoord', 0))}"
    attributes = piece.primitive["attributes"]
    if name not in attributes:
        return None
    uv = read_floats(document, attributes[name], "VEC2", f"{name} of {piece.label}")
    if len(uv) <= piece.used.max():
        return None
    uv = uv[piece.used]
    try:
        scale = np.array(change.get("scale", (1.0, 1.0)), float).reshape(2)
        offset = np.array(change.get("offset", (0.0, 0.0)), float).reshape(2)
        angle = float(change.get("rotation", 0.0))
    except (TypeError, ValueError):
        return uv
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray((uv * scale) @ np.array([[c, -s], [s, c]]) + offset)


def _texture(document: Document, index: int, textures: dict[int, Array | None]) -> Array | None:
    """(H, W, 4) of a texture, linear; None where its image cannot be had."""
    if index not in textures:
        texture = document.items("textures")[index]
        webp = texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source")
        source = texture.get("source", webp)
        textures[index] = None
        if isinstance(source, int) and 0 <= source < len(document.items("images")):
            try:
                textures[index] = _decode(read_image(document, source)[0])
            except Exception as error:  # Pillow raises many kinds on damaged images
                label = document.label("images", source)
                warnings.warn(f"{document.path}: {label} cannot be decoded: {error}", stacklevel=6)
    return textures[index]


def read_image(document: Document, index: int) -> tuple[bytes, str]:
    """The bytes of an image and its media type, wherever it is kept.

    Raises:
        FormatError: It is not there.
    """
    image = document.items("images")[index]
    where = document.label("images", index)
    if "bufferView" in image:
        view = document.items("bufferViews")[image["bufferView"]]
        start = view.get("byteOffset", 0)
        data = bytes(document.buffer(view["buffer"])[start : start + view["byteLength"]])
        if len(data) < view["byteLength"]:
            raise document.error(f"{where} reaches beyond its buffer")
    elif image.get("uri"):
        data = document.read_uri(image["uri"], where)
    else:
        raise document.error(f"{where} has neither a uri nor a bufferView")
    if data.startswith(b"\x89PNG"):
        return data, "image/png"
    if data.startswith(b"\xff\xd8"):
        return data, "image/jpeg"
    return data, str(image.get("mimeType", "image/png"))


def _decode(data: bytes) -> Array:
    from PIL import Image

    with Image.open(io.BytesIO(data)) as picture:
        if picture.width * picture.height > MOST_PIXELS:
            raise ValueError(f"{picture.width} x {picture.height} pixels are too many")
        pixels = np.asarray(picture.convert("RGBA"), np.float64) / 255.0
    rgb = pixels[..., :3]
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return np.concatenate([linear, pixels[..., 3:]], axis=2)


def _sample(image: Array, uv: Array, wrap: dict[str, Any]) -> Array:
    """Bilinear samples (n, 4) of an image at texture coordinates (n, 2)."""
    height, width = image.shape[:2]
    corners = []
    for axis, (size, key) in enumerate(((width, "wrapS"), (height, "wrapT"))):
        place = np.clip(uv[:, axis], -1e6, 1e6) * size - 0.5
        low = np.floor(place).astype(int)
        part = place - low
        mode = wrap.get(key, REPEAT)
        cells = []
        for cell in (low, low + 1):
            if mode == CLAMP:
                cells.append(np.clip(cell, 0, size - 1))
            elif mode == MIRROR:
                folded = cell % (2 * size)
                cells.append(np.where(folded < size, folded, 2 * size - 1 - folded))
            else:
                cells.append(cell % size)
        corners.append((cells, part[:, None]))
    ((x0, x1), fx), ((y0, y1), fy) = corners
    upper = image[y0, x0] * (1 - fx) + image[y0, x1] * fx
    lower = image[y1, x0] * (1 - fx) + image[y1, x1] * fx
    return np.asarray(upper * (1 - fy) + lower * fy)
