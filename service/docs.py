"""/docs: the API on one page, made from the OpenAPI document, without scripts and without any outside request."""

from __future__ import annotations

import json
from html import escape
from typing import Any

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import HTMLResponse

from service.errors import STATUS

router = APIRouter(include_in_schema=False)

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
code, pre { font: 14px/1.4 ui-monospace, monospace; }
pre { overflow-x: auto; padding: .7rem; border: 1px solid #8886; border-radius: 4px; }
h2 { margin-top: 2.5rem; } h3 { margin-bottom: .2rem; } td, th { text-align: left; padding: .1rem 1rem .1rem 0; }
:root { color-scheme: light dark; }
"""
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; form-action 'none'; frame-ancestors 'none'"


@router.get("/docs")
async def docs(request: Request) -> HTMLResponse:
    """Return the page."""
    page = _page(request.app.openapi())
    return HTMLResponse(page, headers={"Content-Security-Policy": _POLICY, "Referrer-Policy": "no-referrer"})


def _page(document: dict[str, Any]) -> str:
    info = document["info"]
    parts = [
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(info['title'])}</title>",
        f"<style>{_STYLE}</style>",
        f"<h1>{escape(info['title'])} {escape(info['version'])}</h1>",
        *(f"<p>{_text(paragraph)}</p>" for paragraph in info["description"].split("\n\n")),
        "<p>The whole description for programs: <a href=openapi.json>openapi.json</a>. Below: "
        "<a href=#operations>operations</a>, <a href=#models>models</a>, <a href=#errors>errors</a>.</p>",
        "<h2 id=operations>Operations</h2>",
    ]
    for path, item in document["paths"].items():
        for method, operation in item.items():
            parts.append(_operation(method.upper(), path, operation, document["components"]["schemas"]))
    parts.append("<h2 id=models>Models</h2>")
    for name, schema in document["components"]["schemas"].items():
        parts.append(_model(name, schema))
    parts.append("<h2 id=errors>Errors</h2><table><tr><th>code<th>status</tr>")
    parts += [f"<tr><td><code>{code}</code><td>{status}</tr>" for code, status in STATUS.items()]
    return "\n".join([*parts, "</table>"])


def _operation(method: str, path: str, operation: dict[str, Any], schemas: dict[str, Any]) -> str:
    lines = [f"<h3 id={operation['operationId']}><code>{method} {escape(path)}</code></h3>"]
    lines.append(f"<p>{_text(operation.get('description', ''))}")
    examples = []
    for media, content in operation.get("requestBody", {}).get("content", {}).items():
        lines.append(f"<br>Takes {escape(media)}: {_type(content['schema'])}.")
        examples = schemas.get(content["schema"].get("$ref", "").rpartition("/")[2], {}).get("examples", [])
    for status, response in operation["responses"].items():
        kinds = ", ".join(_type(content.get("schema", {})) for content in response.get("content", {}).values())
        lines.append(f"<br><code>{status}</code> {kinds} {_text(response['description'])}")
    for example in examples:
        call = f"curl localhost:8000{path} -H 'Content-Type: application/json' -d '{json.dumps(example)}'"
        lines.append(f"<pre>{escape(call)}</pre>")
    return "\n".join(lines)


def _model(name: str, schema: dict[str, Any]) -> str:
    lines = [f"<h3 id=model-{name}>{escape(name)}</h3><p>{_text(schema.get('description', ''))}"]
    if "oneOf" in schema:
        lines.append("<br>One of " + ", ".join(_type(member) for member in schema["oneOf"]) + ".")
    required = schema.get("required", [])
    for field, member in schema.get("properties", {}).items():
        optional = "" if field in required else " (may be left out)"
        said = _text(member.get("description", ""))
        lines.append(f"<br><code>{escape(field)}</code>: {_type(member)}{optional} {said}")
    return "\n".join(lines)


def _type(schema: dict[str, Any]) -> str:
    """Return a short name of what `schema` takes."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"<a href=#model-{name}>{name}</a>"
    if "const" in schema:
        return f"<code>{escape(json.dumps(schema['const']))}</code>"
    if "enum" in schema:
        return " or ".join(f"<code>{escape(json.dumps(value))}</code>" for value in schema["enum"])
    if schema.get("type") == "array":
        low, high = schema.get("minItems", 0), schema.get("maxItems")
        count = f"{low}" if low == high else f"{low} to {high}" if high is not None else f"{low} or more"
        return f"list of {count} times {_type(schema['items'])}"
    return escape(schema.get("type", ""))


def _text(text: str) -> str:
    """Return `text` as HTML; what stands between backquotes is code."""
    parts = escape(text, quote=False).split("`")
    return "".join(f"<code>{part}</code>" if i_part % 2 else part for i_part, part in enumerate(parts))
