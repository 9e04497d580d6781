"""POST /mcp: the calls of the service as tools of a language model (Model Context Protocol), with the extra `mcp`.

Tools are made of the OpenAPI document: each call that takes JSON is one, with the same schema in fewer words. An answer
is small: of each list how long it is and its first items, more by `show` and `start`. What is large is stored first, by
`put_solid` or by HTTP, and named by its id. The library is imported when the first such request comes.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from importlib.util import find_spec
from typing import Any, Final
from urllib.parse import quote

import orjson
from fastapi import FastAPI
from starlette.routing import Route
from starlette.types import Message, Receive, Scope, Send

from service.body import JSON
from service.errors import ServiceError, faults_of, problem
from service.settings import Settings

PATH: Final = "/mcp"
SHOWN: Final = 10
"""Items of a list that are shown unless more are asked for."""
_MOST: Final = 2**20
"""Bytes of a request: it is read on the event loop. Solids that are larger go to /v1/solids."""
_SCHEMAS: Final = "#/components/schemas/"
_WORDS: Final = frozenset(
    ("type", "properties", "required", "items", "enum", "const", "oneOf", "$ref", "minItems", "description", "pattern")
)
"""What a tool's schema keeps; lengths and formats are refused with a sentence anyway."""
_PAGE: Final = {
    "show": {
        "type": "integer",
        "description": f"Items of each list to show, {SHOWN} if left out; the count is always told.",
    },
    "start": {"type": "integer", "description": "The first item to show, 0 if left out."},
}
_INSTRUCTIONS: Final = (
    "Exact geometry: every decision is that of exact arithmetic on the numbers given. Put large or repeated solids "
    'once with put_solid, then name them {"type": "stored", "id": ...} wherever a solid stands.'
)


class Tools:
    """An ASGI application that answers MCP; `running` ends what it started."""

    def __init__(self, app: FastAPI, settings: Settings) -> None:
        self._app = app
        self._most = min(_MOST, settings.max_body_bytes)
        self._manager: asyncio.Future[Any] | None = None
        self._ended = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if find_spec("mcp") is None:
            error = ServiceError("not_installed", "this service offers no tools; use its HTTP calls, /docs lists them")
            await problem(faults_of(error))(scope, receive, send)
            return
        if self._manager is None or (self._manager.done() and self._manager.exception()):  # the last start failed
            self._manager = asyncio.get_running_loop().create_future()
            self._task = asyncio.create_task(self._hold(self._manager))
        manager = await asyncio.shield(self._manager)  # who goes away takes it from nobody
        await manager.handle_request(scope, receive, send)

    async def _hold(self, began: asyncio.Future[Any]) -> None:
        """Run the library's manager, which must be entered and left by one task; hand it, or why not, to `began`."""
        try:
            manager = await asyncio.to_thread(self._made)
            async with manager.run():
                began.set_result(manager)
                await self._ended.wait()
        except Exception as error:
            if began.done():
                raise
            began.set_exception(error)

    async def close(self) -> None:
        """End it."""
        self._ended.set()
        if self._task is not None:
            await self._task

    def _made(self) -> Any:
        import mcp.types as types
        from mcp.server.lowlevel import Server
        from mcp.server.streamable_http_manager import StreamableHTTPSessionManager

        document = self._app.openapi()
        calls = {name: (path, operation) for name, path, operation in _calls(document)}
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
                text, is_error = await self._call(calls[params.name][0], params.arguments or {})
            return types.CallToolResult(content=[types.TextContent(type="text", text=text)], is_error=is_error)

        server = Server(
            "exact-geometry",
            version=self._app.version,
            instructions=_INSTRUCTIONS,
            on_list_tools=list_tools,
            on_call_tool=call_tool,
        )
        return StreamableHTTPSessionManager(
            server, json_response=True, stateless=True, max_request_body_size=self._most
        )

    async def _call(self, path: str, arguments: dict[str, Any]) -> tuple[str, bool]:
        """Return what a call answers, in short, and whether it is an error."""
        given = dict(arguments)
        show, start = (_count(given.pop(name, default)) for name, default in (("show", SHOWN), ("start", 0)))
        if show is None or start is None:
            return "show and start are whole numbers, 0 or more", True
        for name in _parameters(path):
            found = given.pop(name, None)
            if not isinstance(found, str) or not found:
                return f"{name} is missing: it is the id that the call which stored it answered with", True
            path = path.replace(f"{{{name}}}", quote(found, safe=""))
        if path == "/v1/solids":
            given = given.get("solid", given)
        status, answer = await self._asked(path, orjson.dumps(given))
        if status >= 400:
            places = [f"{item['pointer']}: {item['detail']}" for item in answer["errors"] if item["pointer"]]
            return "\n".join([f"{answer['code']}: {answer['detail']}", *places[:5]]), True
        return orjson.dumps(summary(answer, show, start)).decode(), False

    async def _asked(self, path: str, body: bytes) -> tuple[int, Any]:
        """Ask this very service, without a socket."""
        status, parts = 0, []
        headers = [(b"content-type", JSON.encode()), (b"content-length", str(len(body)).encode())]
        scope: Scope = {"type": "http", "method": "POST", "path": path, "raw_path": path.encode(), "root_path": ""}
        scope.update(query_string=b"", headers=headers, app=self._app, scheme="http", http_version="1.1")
        waiting: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

        async def receive() -> Message:
            if waiting:
                return waiting.pop()
            await asyncio.Event().wait()
            raise AssertionError("nobody sets it")

        async def send(message: Message) -> None:
            nonlocal status
            status = message.get("status", status)
            parts.append(message.get("body", b""))

        await self._app.router(scope, receive, send)
        return status, orjson.loads(b"".join(parts))


def add_tools(app: FastAPI, settings: Settings) -> Tools:
    """Offer the tools at /mcp."""
    tools = Tools(app, settings)
    app.router.routes.append(Route(PATH, tools, methods=["POST"], include_in_schema=False))
    return tools


@asynccontextmanager
async def running(tools: Tools) -> AsyncIterator[None]:
    """End the tools at the end."""
    try:
        yield
    finally:
        with suppress(asyncio.CancelledError):
            await tools.close()


def summary(answer: dict[str, Any], show: int, start: int) -> dict[str, Any]:
    """Return an answer with each list as its length and some of its items.

    >>> summary({"contained": [True, False, True], "accuracy": {"items": 3}}, 1, 0)
    {'contained': {'count': 3, 'true': 2, 'items': [True]}, 'accuracy': {'items': 3}}
    """
    found = {}
    for name, value in answer.items():
        if isinstance(value, list):
            told: dict[str, Any] = {"count": len(value)}
            if value and all(isinstance(item, bool) for item in value):
                told["true"] = sum(value)
            value = {**told, "items": [_cut(item, max(show, 3)) for item in value[start : start + show]]}
        found[name] = value
    return found


def _cut(value: Any, show: int) -> Any:
    """Return a value of a list with its own lists cut short."""
    if isinstance(value, dict):
        return {name: _cut(item, show) for name, item in value.items()}
    if isinstance(value, list):
        items = [_cut(item, show) for item in value[:show]]
        return items if len(value) <= show else {"count": len(value), "first": items}
    return value


def _count(value: Any) -> int | None:
    return value if type(value) is int and value >= 0 else None


def _calls(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        if JSON in item.get("post", {}).get("requestBody", {}).get("content", {}):
            yield item["post"]["operationId"], path, item["post"]


def _parameters(path: str) -> list[str]:
    return [part[1:-1] for part in path.split("/") if part.startswith("{")]


def _input(path: str, operation: dict[str, Any], document: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a tool's arguments: the body's model, what the path has in it, and which items to show."""
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
    found: dict[str, Any] = {}
    waiting = _names(made)
    while waiting:  # bound: each name is taken in once
        name = waiting.pop()
        if name not in found:
            found[name] = _terse(schemas[name])
            waiting += _names(found[name])
    return {**made, "$defs": dict(sorted(found.items()))}


def _in_a_sentence(union: dict[str, Any], schemas: dict[str, Any]) -> dict[str, Any]:
    """Return the union of solids as an object whose description names types and fields: put_solid has all of it."""
    kinds = []
    for kind, reference in union["discriminator"]["mapping"].items():
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
