"""POST /mcp: the calls of the service as tools of a language model (Model Context Protocol), with the extra `mcp`.

Tools are made of the OpenAPI document: each call that takes JSON is one, with the same schema in fewer words. An answer
is small: of each list how long it is and its first items, more by `show` and `start`. What is large is stored first, by
`put_solid` or by HTTP, and named by its id. The library is imported when the first such request comes.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterable
from contextlib import suppress
from importlib.util import find_spec
from ipaddress import ip_address
from typing import Any, Final
from urllib.parse import urlsplit

import orjson
from fastapi import APIRouter, FastAPI
from starlette.requests import ClientDisconnect
from starlette.types import Message, Receive, Scope, Send

from engine import EngineError
from service import wire
from service.body import JSON, declared_length, read
from service.convert.summaries import summary
from service.decoding.pieces import Body
from service.errors import ServiceError, faults_of, problem
from service.route import GeometryRoute, watch
from service.settings import Settings
from service.work import Call

PATH: Final = "/mcp"
SHOWN: Final = 10
"""Items of a list that are shown by default."""
_MOST: Final = 2**20
"""Largest request in bytes. Larger solids go to /v1/solids."""
_MOST_AROUND: Final = 2**16
"""Bytes of a request besides a tool's arguments: the library reads them on the event loop."""
_MOST_SHOWN: Final = 1000
"""Largest number of items of a list that are shown, far more than a model reads."""
_CALL: Final = "geometry.asked"
"""Key, in the scope of a request, of its call and a tool's arguments."""
_SCHEMAS: Final = "#/components/schemas/"
_WORDS: Final = frozenset(
    ("type", "properties", "required", "items", "enum", "const", "oneOf", "$ref", "minItems", "description", "pattern")
)
"""Keywords of a tool's schema that remain; violations of the others get an error message anyway."""
_PAGE: Final = {
    "show": {
        "type": "integer",
        "description": f"Items of each list to show, {SHOWN} if left out, {_MOST_SHOWN} at most; all are counted.",
    },
    "start": {"type": "integer", "description": "The first item to show, 0 if left out."},
}
_INSTRUCTIONS: Final = (
    "Exact geometry: every decision is that of exact arithmetic on the numbers given. Put large or repeated solids "
    'once with put_solid, then name them {"type": "stored", "id": ...} wherever a solid stands.'
)


class Tools:
    """An ASGI application that answers MCP; to leave its context ends what it started.

    The library gets a request without the arguments of its call, which are decoded here, as bodies are; of an answer no
    more than is shown is ever written.
    """

    def __init__(self, app: FastAPI, settings: Settings, routers: Iterable[APIRouter]) -> None:
        self._app = app
        self._settings = settings.model_copy(update={"max_body_bytes": min(_MOST, settings.max_body_bytes)})
        self._routes = {
            route.path: route for each in routers for route in each.routes if isinstance(route, GeometryRoute)
        }
        self._manager: asyncio.Future[Any] | None = None
        self._ended = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        state = self._app.state
        call = Call(self._settings, state.store, state.memory)
        try:
            if find_spec("mcp") is None:
                detail = "this service offers no tools; use its HTTP calls, /docs lists them"
                raise ServiceError("not_installed", detail)
            headers = dict(scope["headers"])
            check_origin(headers, self._settings)
            declared = declared_length(headers, self._settings.max_body_bytes)
            text = await read(receive, declared, call)
            call.start_clock()
            text, arguments = await state.pool.run(call, lambda: _parted(text, call), is_small=True)
            if self._manager is None or (self._manager.done() and self._manager.exception()):  # the last start failed
                self._manager = asyncio.get_running_loop().create_future()
                self._task = asyncio.create_task(self._hold(self._manager))
            manager = await asyncio.shield(self._manager)  # who goes away takes it from nobody
            own = [header for header in scope["headers"] if header[0] not in (b"content-length", b"transfer-encoding")]
            own.append((b"content-length", str(len(text)).encode()))
            passed = {**scope, "headers": own, _CALL: (call, arguments)}
            disconnected = asyncio.create_task(watch(call, receive))
            try:
                await manager.handle_request(passed, _replayed(text, disconnected), send)
            finally:
                disconnected.cancel()
        except (ServiceError, EngineError) as error:
            await problem(faults_of(error))(scope, receive, send)
        except ClientDisconnect:
            pass
        finally:
            call.free()

    async def _hold(self, began: asyncio.Future[Any]) -> None:
        """Run the library's manager, which one task must enter and leave; pass it, or its error, to `began`."""
        try:
            manager = await asyncio.to_thread(self._made)
            async with manager.run():
                began.set_result(manager)
                await self._ended.wait()
        except Exception as error:
            if began.done():
                raise
            began.set_exception(error)

    async def __aenter__(self) -> None:
        """Start nothing: the first request does."""

    async def __aexit__(self, *_: object) -> None:
        self._ended.set()
        if self._task is not None:
            with suppress(asyncio.CancelledError):
                await self._task

    def _made(self) -> Any:
        import mcp.types as types
        from mcp.server.lowlevel import Server
        from mcp.server.streamable_http_manager import StreamableHTTPSessionManager

        document = self._app.openapi()
        posts = [(path, item["post"]) for path, item in document["paths"].items() if "post" in item]
        calls = {each["operationId"]: (path, each) for path, each in posts if JSON in each["requestBody"]["content"]}
        tools = [
            types.Tool(
                name=name, description=_short(operation["description"]), input_schema=_input(path, operation, document)
            )
            for name, (path, operation) in calls.items()
        ]

        async def list_tools(context: Any, params: Any) -> Any:
            return types.ListToolsResult(tools=tools)

        async def call_tool(context: Any, params: Any) -> Any:
            if params.name not in calls:
                text, is_error = f"there is no tool {params.name[:100]!r}; the tools are {', '.join(calls)}", True
            else:
                call, arguments = context.request.scope[_CALL]
                text, is_error = await self._call(calls[params.name][0], arguments, call)
            return types.CallToolResult(content=[types.TextContent(type="text", text=text)], is_error=is_error)

        server = Server(
            "exact-geometry",
            version=self._app.version,
            instructions=_INSTRUCTIONS,
            on_list_tools=list_tools,
            on_call_tool=call_tool,
        )
        return StreamableHTTPSessionManager(server, json_response=True, stateless=True, max_request_body_size=_MOST)

    async def _call(self, path: str, given: dict[str, Any], call: Call) -> tuple[str, bool]:
        """Return the short answer of a call, and whether it is an error."""
        show, start = (_count(given.pop(name, default)) for name, default in (("show", SHOWN), ("start", 0)))
        if show is None or start is None or show > _MOST_SHOWN:
            return f"show and start are whole numbers, 0 or more, show at most {_MOST_SHOWN}", True
        arguments: dict[str, Any] = {}
        for name in _parameters(path):
            present = given.pop(name, None)
            if not isinstance(present, str) or not present:
                return f"{name} is missing: it is the id that the call which stored it answered with", True
            arguments[name] = present
        if path == "/v1/solids":
            given = given.get("solid", given)

        def shown(answer: Any) -> bytes:
            return wire.encode(summary(answer, show, start, call.remaining))

        answer = await self._routes[path].ask(given, arguments, call, self._app.state, shown)
        if isinstance(answer, bytes):
            return answer.decode(), False
        refused = orjson.loads(problem(answer).body)
        places = [f"{item['pointer']}: {item['detail']}" for item in refused["errors"] if item["pointer"]]
        return "\n".join([f"{refused['code']}: {refused['detail']}", *places[:5]]), True


def check_origin(headers: dict[bytes, bytes], settings: Settings) -> None:
    """Raise `wrong_origin` if another site's page asks, through a browser of somebody who may.

    A page's site stands in Origin. Without keys and on a loopback address, Host must name this machine: a page
    may have its site's name lead here, and then is of one origin with the service.
    """
    host, origin = (headers.get(name, b"").decode("latin-1").lower() for name in (b"host", b"origin"))
    known = [each.lower() for each in settings.cors_origins]
    name = _name_in(f"//{host}")
    own = {settings.host.lower(), *map(_name_in, known)}
    if not settings.api_keys and _is_loopback(settings.host) and not _is_loopback(name) and name not in own:
        detail = f"the service does not know itself as {host[:100]!r}; ask it as localhost, or set GEOMETRY_API_KEYS, "
        raise ServiceError("wrong_origin", detail + f"or https://{host[:100]} in GEOMETRY_CORS_ORIGINS")
    if origin and "*" not in known and origin not in known and origin.partition("://")[2] != host:
        detail = f"pages of {origin[:100]!r} may not ask; whoever runs the service may name it in GEOMETRY_CORS_ORIGINS"
        raise ServiceError("wrong_origin", detail)


def _name_in(address: str) -> str:
    with suppress(ValueError):
        return urlsplit(address).hostname or ""
    return ""


def _is_loopback(name: str) -> bool:
    with suppress(ValueError):
        return ip_address(name).is_loopback
    return name == "localhost"


def _parted(text: Body, call: Call) -> tuple[bytes, dict[str, Any]]:
    """Return a request of the protocol without the arguments of a tool, for the library, and the arguments."""
    call.remaining()  # it may have waited past its deadline
    call.take(wire.cost_of(text))
    message = wire.decode(text, call.remaining)
    arguments: Any = {}
    params = message.get("params") if isinstance(message, dict) else None
    if isinstance(params, dict) and message.get("method") == "tools/call":
        arguments = params.pop("arguments", None) or {}
        if isinstance(arguments, dict):
            params["arguments"] = {}
            text = json.dumps(message).encode()
        else:
            params["arguments"], arguments = arguments, {}  # the library refuses it
    if len(text) > _MOST_AROUND:
        raise ServiceError("body_too_large", f"a request holds {_MOST_AROUND} bytes at most beside a tool's arguments")
    return bytes(memoryview(text)), arguments


def _replayed(text: bytes, disconnected: asyncio.Task[None]) -> Receive:
    """Return a receiver that delivers a body, and then waits for the client to disconnect."""
    waiting: list[Message] = [{"type": "http.request", "body": text, "more_body": False}]

    async def receive() -> Message:
        if waiting:
            return waiting.pop()
        await asyncio.wait([disconnected])
        return {"type": "http.disconnect"}

    return receive


def _count(value: Any) -> int | None:
    return value if type(value) is int and value >= 0 else None


def _parameters(path: str) -> list[str]:
    return [part[1:-1] for part in path.split("/") if part.startswith("{")]


def _input(path: str, operation: dict[str, Any], document: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a tool's arguments: the body's model, path parameters, and which items to show."""
    schemas = document["components"]["schemas"]
    reference = operation["requestBody"]["content"][JSON]["schema"]
    body = schemas[reference["$ref"].removeprefix(_SCHEMAS)]
    if "properties" not in body:  # a union at the root is not taken by all
        body = {"type": "object", "properties": {"solid": reference}, "required": ["solid"]}
    else:
        schemas = {**schemas, "Solid": _in_a_sentence(schemas["Solid"], schemas)}
    ids = {name: {"type": "string", "description": "From the call that stored it."} for name in _parameters(path)}
    made: dict[str, Any] = _terse(body)
    made["properties"] = {**ids, **made["properties"], **_PAGE}
    made["required"] = [*ids, *made.get("required", [])]
    made.pop("description", None)
    present: dict[str, Any] = {}
    waiting = _names(made)
    while waiting:  # bound: each name is taken in once
        name = waiting.pop()
        if name not in present:
            present[name] = _terse(schemas[name])
            waiting += _names(present[name])
    return {**made, "$defs": dict(sorted(present.items()))}


def _in_a_sentence(union: dict[str, Any], schemas: dict[str, Any]) -> dict[str, Any]:
    """Return the union of solids as an object whose description names types and fields: put_solid has all of it."""
    kinds = []
    named = {reference: kind for kind, reference in union["discriminator"]["mapping"].items()}  # GeoJSON's once
    for reference, kind in named.items():
        fields = [name for name in schemas[reference.removeprefix(_SCHEMAS)]["properties"] if name != "type"]
        kinds.append(f"{kind} ({', '.join(fields)})")
    return {"type": "object", "description": f"By `type`, with its fields: {'; '.join(kinds)}; see put_solid."}


def _names(node: Any) -> list[str]:
    if isinstance(node, dict):
        own = [node["$ref"].rpartition("/")[2]] if isinstance(node.get("$ref"), str) else []
        return own + [name for value in node.values() for name in _names(value)]
    return [name for item in node for name in _names(item)] if isinstance(node, list) else []


def _terse(schema: Any, is_schema: bool = True) -> Any:
    """Return a JSON schema in fewer words."""
    if isinstance(schema, list):
        return [_terse(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    made = {}
    for key, value in schema.items():
        if is_schema and key not in _WORDS:
            continue
        if is_schema and key == "description":
            value = _short(value)
        elif is_schema and key == "$ref":
            value = value.replace(_SCHEMAS, "#/$defs/")
        made[key] = _terse(value, not (is_schema and key == "properties"))
    if "const" in made:
        made.pop("description", None)
    return made


def _short(text: str) -> str:
    """Return the first sentence."""
    return " ".join(text.split()).partition(". ")[0].rstrip(".") + "."
