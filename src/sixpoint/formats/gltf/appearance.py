"""Materials and textures: one colour per vertex, and what is between vertices.

Base colour factor times base colour texture times vertex colour; what needs light or a view (metal, normal
maps, toon shading) is left out. An image that cannot be decoded is said and counts as white.

Reference: Khronos, glTF 2.0 specification, section 3.9 (materials), 3.8 (textures); KHR_texture_transform.
"""

from __future__ import annotations

import io
import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.surface.appearance import Appearance, Bytes, Texture, Texturing, halved
from sixpoint.formats.gltf.accessors import read_floats
from sixpoint.formats.gltf.document import Document
from sixpoint.formats.gltf.mesh import Piece

Array = NDArray[np.float64]

REPEAT = 10497
WRAPS = {REPEAT: "repeat", 33071: "clamp", 33648: "mirror"}
MOST_PIXELS = 64_000_000
SMALLEST = 16  # pixels: smaller copies of an image show nothing


def read_appearance(document: Document, pieces: list[Piece]) -> Appearance:
    """Colours and textures of all pieces, in their order."""
    textures: dict[tuple[int, bool], Texture | None] = {}
    used: list[Texture] = []
    colours, chosen, places, tints = [], [], [], []
    for piece in pieces:
        tint, reference = _read_tint(document, piece)
        opaque = _is_opaque(document, piece)
        texture = None if reference is None else _texture(document, reference["index"], opaque, textures)
        place = None if reference is None or texture is None else _read_uv(document, piece, reference)
        number, colour = -1, tint
        if texture is not None and place is not None:
            if texture not in used:
                used.append(texture)
            number, colour = used.index(texture), tint * texture.sample(place)
        if opaque:
            colour[:, 3] = 1.0
        colours.append(np.clip(colour, 0.0, 1.0))
        chosen.append(np.full(len(piece.triangles), number))
        places.append(np.zeros((len(tint), 2)) if place is None else place)
        tints.append(tint)
    texturing = None
    if used:
        joined = (np.concatenate(parts) for parts in (chosen, places, tints))
        texturing = Texturing(tuple(used), *joined)
    return Appearance(np.concatenate(colours), texturing)


def _read_tint(document: Document, piece: Piece) -> tuple[Array, dict[str, Any] | None]:
    """Factor times vertex colour (n, 4) of a piece, and how its material names a texture."""
    attributes = piece.primitive["attributes"]
    tint, reference = np.ones((len(piece.used), 4)), None
    if "material" in piece.primitive:
        surface = document.items("materials")[piece.primitive["material"]].get("pbrMetallicRoughness", {})
        tint *= surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        reference = surface.get("baseColorTexture")
    if "COLOR_0" in attributes:
        kind = document.items("accessors")[attributes["COLOR_0"]]["type"]
        shade = read_floats(document, attributes["COLOR_0"], kind, f"COLOR_0 of {piece.label}")
        if len(shade) > piece.used.max() and shade.shape[1] in (3, 4):
            tint[:, : shade.shape[1]] *= shade[piece.used]
    return tint, reference


def _is_opaque(document: Document, piece: Piece) -> bool:
    """Whether opacity is to be ignored, which it is unless a material says otherwise."""
    if "material" not in piece.primitive:
        return True
    return bool(
        document.items("materials")[piece.primitive["material"]].get("alphaMode", "OPAQUE") == "OPAQUE"
    )


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


def _texture(
    document: Document, index: int, opaque: bool, textures: dict[tuple[int, bool], Texture | None]
) -> Texture | None:
    """A texture, without its opacity for opaque materials; None where its image cannot be had."""
    if (index, opaque) not in textures:
        texture = document.items("textures")[index]
        webp = texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source")
        source = texture.get("source", webp)
        textures[index, opaque] = None
        if isinstance(source, int) and 0 <= source < len(document.items("images")):
            try:
                levels = _decode(read_image(document, source)[0], opaque)
                sampler = texture.get("sampler")
                keys = {} if sampler is None else document.items("samplers")[sampler]
                wrap = (
                    WRAPS.get(keys.get("wrapS", REPEAT), "repeat"),
                    WRAPS.get(keys.get("wrapT", REPEAT), "repeat"),
                )
                textures[index, opaque] = Texture(levels, wrap)
            except Exception as error:  # Pillow raises many kinds on damaged images
                label = document.label("images", source)
                warnings.warn(f"{document.path}: {label} cannot be decoded: {error}", stacklevel=6)
    return textures[index, opaque]


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


def _decode(data: bytes, opaque: bool) -> tuple[Bytes, ...]:
    from PIL import Image

    with Image.open(io.BytesIO(data)) as picture:
        if picture.width * picture.height > MOST_PIXELS:
            raise ValueError(f"{picture.width} x {picture.height} pixels are too many")
        levels = [np.array(picture.convert("RGBA"))]
    if opaque:
        levels[0][..., 3] = 255
    while min(levels[-1].shape[:2]) >= 2 * SMALLEST:
        levels.append(halved(levels[-1]))
    return tuple(levels)
