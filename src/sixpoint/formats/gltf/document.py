"""A glTF document: its JSON, checked, and its binary buffers.

Reads ``.gltf`` (JSON with external files or data URIs) and ``.glb`` (``.vrm``, ``.vrma``: one file with a
JSON and a BIN chunk). Buffers are views of the bytes that were read; nothing is copied.

Reference: Khronos, glTF 2.0 specification, sections 3.6.1 (buffers) and 4 (GLB file format).
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from sixpoint.errors import FormatError
from sixpoint.formats.gltf.schema import SchemaError, check_document
from sixpoint.formats.source import read_bytes

MAGIC = b"glTF"
JSON_CHUNK, BIN_CHUNK = 0x4E4F534A, 0x004E4942

READ_REQUIRED = ("VRM", "VRMC_", "KHR_materials_", "KHR_texture_", "KHR_mesh_quantization", "KHR_lights_")
"""Beginnings of extensions that a file may require without harm to skeleton, skin and movement."""
COMPRESSIONS = {
    "KHR_draco_mesh_compression": "Draco-compressed meshes (KHR_draco_mesh_compression)",
    "EXT_meshopt_compression": "meshopt-compressed buffers (EXT_meshopt_compression)",
    "KHR_meshopt_compression": "meshopt-compressed buffers (KHR_meshopt_compression)",
}


@dataclass(eq=False, repr=False)
class Document:
    """One glTF file.

    Attributes:
        path: The file.
        content: Its JSON, checked by ``check_document``; never changed.
        binary: The BIN chunk of a GLB; empty in a .gltf.
    """

    path: Path
    content: dict[str, Any]
    binary: memoryview
    _buffers: dict[int, memoryview] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Document({self.path.name!r}, {len(self.items('nodes'))} nodes)"

    def items(self, kind: str) -> list[dict[str, Any]]:
        """The objects of a top-level array, e.g. "nodes"."""
        found: list[dict[str, Any]] = self.content.get(kind, [])
        return found

    @property
    def extensions(self) -> dict[str, Any]:
        """Extensions of the document itself."""
        found: dict[str, Any] = self.content.get("extensions", {})
        return found

    def label(self, kind: str, index: int) -> str:
        """``nodes[3] 'Hips'``, for messages."""
        name = self.items(kind)[index].get("name", "")
        return f"{kind}[{index}]" + (f" {name!r}" if isinstance(name, str) and name else "")

    def error(self, message: str) -> FormatError:
        """An error that names the file."""
        return FormatError(self.path, message)

    def buffer(self, index: int) -> memoryview:
        """The bytes of a buffer; external ones are read on first use."""
        if index not in self._buffers:
            self._buffers[index] = self._read_buffer(index)
        return self._buffers[index]

    def _read_buffer(self, index: int) -> memoryview:
        buffer = self.items("buffers")[index]
        where = f"buffers[{index}]"
        if "uri" in buffer:
            data = memoryview(self.read_uri(buffer["uri"], where))
        elif index == 0 and len(self.binary):
            data = self.binary
        else:
            raise self.error(f"{where} has no uri and the file has no BIN chunk for it")
        if len(data) < buffer["byteLength"]:
            raise self.error(
                f"{where} is cut: {buffer['byteLength']} bytes are declared, there are {len(data)}"
            )
        return data[: buffer["byteLength"]]

    def read_uri(self, uri: str, where: str) -> bytes:
        """The bytes behind a data URI, or of a file beside this one.

        Args:
            uri: The URI.
            where: Which object has it, for messages.

        Raises:
            FormatError: It cannot be read; nothing is ever fetched from a network.
        """
        shown = uri if len(uri) <= 60 else uri[:57] + "..."
        if uri[:5].lower() == "data:":
            head, comma, payload = uri.partition(",")
            if not comma or not head.lower().endswith(";base64"):
                raise self.error(f"{where}: the data URI is not base64: {shown}")
            try:
                return base64.b64decode(payload, validate=True)
            except (binascii.Error, ValueError) as error:
                raise self.error(f"{where}: the data URI is damaged: {error}") from None
        name = unquote(uri)
        if "://" in name or "\0" in name or Path(name).is_absolute():
            raise self.error(f"{where}: only files beside this one and data URIs are read, not {shown!r}")
        try:
            return read_bytes(self.path.parent / name)
        except FormatError as error:
            reason = str(error).removeprefix(f"{error.path}: ")
            raise self.error(f"{where}: {name!r} beside the file: {reason}") from None


def read_document(path: Path) -> Document:
    """Read a .gltf, .glb, .vrm or .vrma file.

    Raises:
        FormatError: It is damaged, or not glTF 2.0; the message says where.
    """
    data = read_bytes(path)
    is_text = not data.startswith(MAGIC)
    if is_text and data.lstrip()[:1] not in (b"{", b"\xef"):
        raise FormatError(path, f"this is no glTF file: it begins with {data[:4]!r}, not with 'glTF' or '{{'")
    if is_text and path.suffix.lower() in (".vrm", ".vrma"):
        raise FormatError(
            path, f"a {path.suffix} file is a GLB, this one is text; if it is glTF, call it .gltf"
        )
    source, binary = (data, memoryview(b"")) if is_text else _split_glb(path, data)
    try:
        content = json.loads(bytes(source).decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise FormatError(path, f"the JSON is not UTF-8: {error}") from None
    except json.JSONDecodeError as error:
        raise FormatError(path, f"the JSON is damaged: {error.msg}", line=error.lineno) from None
    except (RecursionError, ValueError) as error:
        raise FormatError(path, f"the JSON cannot be read: {error}") from None
    try:
        check_document(content)
    except SchemaError as error:
        raise FormatError(path, f"not a valid glTF 2.0 document: {error}") from None
    document = Document(path, content, binary)
    for name in content.get("extensionsRequired", []):
        if not name.startswith(READ_REQUIRED):
            what = COMPRESSIONS.get(name, f"the extension {name}")
            raise document.error(f"{what}, which the file requires: not supported; export without it")
    return document


def _split_glb(path: Path, data: bytes) -> tuple[memoryview, memoryview]:
    """The JSON chunk and the BIN chunk (empty if there is none)."""
    if len(data) < 20:
        raise FormatError(path, f"the GLB is cut: {len(data)} bytes do not even hold its headers")
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2:
        raise FormatError(path, f"this is GLB version {version}, only 2 is supported")
    if length > len(data):
        raise FormatError(path, f"the GLB is cut: {length} bytes are declared, the file has {len(data)}")
    view = memoryview(data)
    chunks: list[tuple[int, memoryview]] = []
    start = 12
    while start + 8 <= length:
        size, kind = struct.unpack_from("<II", data, start)
        if start + 8 + size > length:
            raise FormatError(
                path,
                f"the GLB is cut: chunk {len(chunks)} at byte {start} declares {size} bytes, "
                f"{length - start - 8} are left",
            )
        chunks.append((kind, view[start + 8 : start + 8 + size]))
        start += 8 + size + -size % 4
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise FormatError(path, "the first chunk of the GLB is not JSON")
    binaries = [chunk for kind, chunk in chunks[1:2] if kind == BIN_CHUNK]
    return chunks[0][1], binaries[0] if binaries else memoryview(b"")
