"""Reads request bodies within their limits: media type, length and content coding.

A large one is received into one buffer of the declared length. A compressed one is inflated off the event loop, part by
part, so that it ends as soon as it is known to be too long.
"""

from __future__ import annotations

import asyncio
import mmap
import re
import zlib
from collections.abc import Iterator
from contextlib import suppress
from io import BytesIO
from typing import Any, Final

import zstandard
from starlette.requests import ClientDisconnect
from starlette.types import Receive

from service.decoding.pieces import Body
from service.errors import ServiceError
from service.memory import FOOTPRINT, PART
from service.work import Call

JSON: Final = "application/json"
OCTETS: Final = "application/octet-stream"
LARGE: Final = 2**22
"""Bytes from which a body gets huge pages: freeing 64 MB of small pages blocks all threads for 5 ms."""
CODINGS: Final = ("gzip", "zstd")
_STEP: Final = 2**18
"""Bytes inflated per step: half a millisecond."""
_STEP_IN: Final = 2**14
"""Bytes of gzip input per step: a member may be of 20 bytes, and what follows one is copied."""
_BLOCKS: Final = 2**8
"""Bytes of zstd inflated per step: a block takes four at least, and gives 128 KB at most."""
_WINDOW: Final = 2**23
"""Largest window of a zstd body: the one that decoders should support (RFC 8878, 3.1.1.1.2)."""


FILES: Final = {
    "model/stl": "stl",
    "model/obj": "obj",
    "model/off": "off",
    "model/ply": "ply",
    "model/gltf-binary": "glb",
}
"""Formats of mesh files by media type."""
FILES_OUT: Final = ("model/ply", "model/off", "model/stl")
"""Those that are written."""
_WEIGHT: Final = re.compile(r"(?:^|;)\s*q=([01](?:\.\d{0,3})?)\s*(?:;|$)")
MULTIPART: Final = "multipart/form-data"
_BOUNDARY: Final = re.compile(r"""boundary=(?:"([^"]{1,70})"|([^\s;"]{1,70}))""", re.IGNORECASE)
_FIELD: Final = re.compile(rb"""[;\s](name|filename)=(?:"([^"]*)"|([^\s;"]+))""", re.IGNORECASE)
_MOST_PARTS: Final = 16
_LONGEST_HEAD: Final = 2**13
"""Bytes of the headers of a part, from the boundary before them."""


def media_type_of(headers: dict[bytes, bytes]) -> str:
    """Return the media type of a body without its parameters."""
    return headers.get(b"content-type", b"").decode("latin-1").partition(";")[0].strip().lower()


def fields_of(form: Body, content_type: str) -> dict[str, tuple[str, bytes]]:
    """Return the fields of a form (multipart/form-data, RFC 7578) by name: the name of its file, if any, and its bytes.

    Raises: `bad_request` for what is no form.
    """
    boundary = _BOUNDARY.search(content_type)
    mark = b"" if boundary is None else b"--" + (boundary[1] or boundary[2]).encode("latin-1")
    at = form.find(mark) if mark else -1
    fields: dict[str, tuple[str, bytes]] = {}
    while at >= 0 and len(fields) < _MOST_PARTS:  # bound: each turn goes on to the next mark
        start = at + len(mark)
        if bytes(form[start : start + 2]) == b"--":
            return fields
        head = form.find(b"\r\n\r\n", start, start + _LONGEST_HEAD)
        end = form.find(b"\r\n" + mark, head + 2) if head >= 0 else -1
        if end < 0:
            break
        named = {each[1].lower(): each[2] or each[3] or b"" for each in _FIELD.finditer(bytes(form[start:head]))}
        name = named.get(b"name", b"").decode("utf-8", "replace")
        if name in fields:
            break
        fields[name] = named.get(b"filename", b"").decode("utf-8", "replace"), bytes(form[head + 4 : end])
        at = end + 2
    detail = "the body is no form: a part, or its end, is missing or there twice; curl -F file=@NAME makes one"
    raise ServiceError("bad_request", detail)


def file_wanted(accept: str) -> str | None:
    """Return the media type of a mesh file that a header Accept (RFC 9110, 12.5.1) prefers to JSON; the first of
    equals."""
    wanted, most = "", 0.0
    for item in accept.lower().split(","):
        kind, _, parameters = item.partition(";")
        weight = _WEIGHT.search(parameters)
        if float(weight[1] if weight else 1) > most and kind.strip() in (*FILES_OUT, JSON, "application/*", "*/*"):
            wanted, most = kind.strip(), float(weight[1] if weight else 1)
    return wanted if wanted in FILES_OUT else None


def check_media_type(headers: dict[bytes, bytes], expected: str) -> None:
    """Raise unless the body has the media type of the route; octets need none, since they can be nothing else."""
    given = headers.get(b"content-type", b"").decode("latin-1")
    kind = media_type_of(headers)
    is_json = expected == JSON and kind.startswith("application/") and kind.endswith("+json")
    if kind != expected and not is_json and (given or expected == JSON):
        got = f"got {given[:100]!r}" if given else "got none"
        error = ServiceError("unsupported_media_type", f"expected the header Content-Type: {expected}, {got}")
        error.headers = {"Accept-Post": expected}
        raise error


def coding_of(headers: dict[bytes, bytes]) -> str | None:
    """Return the content coding of the body, None if it is not compressed."""
    coding = headers.get(b"content-encoding", b"").decode("latin-1").strip().lower()
    coding = {"x-gzip": "gzip", "identity": ""}.get(coding, coding)
    if coding and coding not in CODINGS:
        detail = f"Content-Encoding {coding[:100]!r} is not taken; send {' or '.join(CODINGS)}, or leave it out"
        error = ServiceError("unsupported_media_type", detail)
        error.headers = {"Accept-Encoding": ", ".join(CODINGS)}
        raise error
    return coding or None


def declared_length(headers: dict[bytes, bytes], limit: int) -> int:
    """Return the declared length, 0 if there is none; raise `body_too_large` beyond the limit."""
    given = headers.get(b"content-length", b"0").lstrip(b"0") or b"0"
    if not given.isdigit():
        return 0
    if len(given) > 18 or int(given) > limit:  # Python reads no number of thousands of digits
        raise _too_large(limit)
    return int(given)


async def read(receive: Receive, declared: int, call: Call) -> Body:
    """Return the body; raise as soon as it is too long, declared or not, or too slow.

    The bytes that arrived are counted, not the declared ones: these are refused only if they would not fit now.
    """
    limit, seconds = call.settings.max_body_bytes, call.settings.body_seconds
    await call.wait_for(FOOTPRINT * declared)
    room: bytearray | mmap.mmap | None = None
    parts: list[bytes] = []
    size, is_more = 0, True
    try:
        async with asyncio.timeout(seconds):
            while is_more:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise ClientDisconnect
                part, is_more = message.get("body", b""), message.get("more_body", False)
                end = size + len(part)
                if end > limit:
                    raise _too_large(limit)
                cost = FOOTPRINT * len(part) + PART
                await call.wait_for(cost)
                call.take(cost)
                if room is None and LARGE <= end <= declared:
                    room = _room(declared)
                    room[:size], parts = b"".join(parts), []
                elif room is not None and end > declared:  # case: a server that lets bodies be longer than declared
                    parts, room = [bytes(room[:size])], None
                if room is None:
                    parts.append(part)
                else:
                    room[size:end] = part
                size = end
    except TimeoutError:
        raise ServiceError("slow_body", f"the body did not arrive within {seconds} s; send it faster") from None
    if room is not None:
        return room if size == declared else room[:size]
    return parts[0] if len(parts) == 1 else b"".join(parts)


def inflated(body: Body, coding: str, call: Call) -> bytes:
    """Return the decompressed body."""
    limit, size, whole = call.settings.max_body_bytes, 0, BytesIO()
    try:
        for part in _inflated(body, coding):
            call.remaining()
            size += len(part)
            if size > limit:
                raise _too_large(limit, "inflated, ")
            call.take(FOOTPRINT * len(part))
            whole.write(part)
    except (zlib.error, zstandard.ZstdError, EOFError) as error:
        raise ServiceError("bad_request", f"the body is no {coding}: {error}; compress it again") from None
    return whole.getvalue()


def _inflated(body: Body, coding: str) -> Iterator[bytes]:
    """Yield the content of the members of a gzip body (RFC 1952, 2.2), or the frames of a zstd body (RFC 8878, 3.1)."""
    packed: Any = None  # a member or frame that is not over
    is_gzip, unpacker = coding == "gzip", zstandard.ZstdDecompressor(max_window_size=_WINDOW)
    step, most = (_STEP_IN, (_STEP,)) if is_gzip else (_BLOCKS, ())
    for start in range(0, len(body), step):
        rest = body[start : start + step]
        while rest:  # bound: each turn takes bytes, or gives a whole part
            packed = packed or (zlib.decompressobj(wbits=16 + zlib.MAX_WBITS) if is_gzip else unpacker.decompressobj())
            yield packed.decompress(rest, *most)
            rest = packed.unconsumed_tail
            if packed.eof:
                rest, packed = packed.unused_data, None
    while packed is not None and not packed.eof:  # bound: each turn gives a part
        part = packed.decompress(b"", *most)
        if not part:
            break
        yield part
    if not len(body) or (packed is not None and not packed.eof):
        raise EOFError("it ends too early")


def _room(size: int) -> bytearray | mmap.mmap:
    """Return a buffer of so many bytes; untouched pages take no memory."""
    if not hasattr(mmap, "MADV_HUGEPAGE"):
        return bytearray(size)
    try:
        room = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    except OSError:  # the process may have no more
        raise MemoryError from None
    with suppress(OSError):  # a kernel without large pages
        room.madvise(mmap.MADV_HUGEPAGE)
    return room


def _too_large(limit: int, how: str = "") -> ServiceError:
    detail = f"{how}the body is longer than {limit} bytes; send less at once, or raise GEOMETRY_MAX_BODY_BYTES"
    return ServiceError("body_too_large", detail)
