"""Clients generated from the stored document are called against the running service, and Java's own client too.

Each part runs where its tools are installed: openapi-python-client (the extra `test`), openapi-generator-cli (from
PyPI, with its Java program inside), npm, a JDK, Debian's Jackson, Go with Debian's validator, Ruby with Debian's
Typhoeus, PHP with Debian's Guzzle, cargo with Debian's reqwest and tokio.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.unit.service.test_live import Service

DOCUMENT = Path(__file__).with_name("openapi.json")
CALLS = Path(__file__).with_name("clients")
ANSWERS = ["201", "[false,true,true]", "touching", "422"]
JACKSON = [Path("/usr/share/java") / f"jackson-{part}.jar" for part in ("core", "annotations", "databind")]
GO_PATH = Path("/usr/share/gocode")
SHARED = {"ruby": "rubygems-integration/all/gems/typhoeus-*", "php": "php/GuzzleHttp"}
"""Where Debian has what a generated client sends its requests with, below /usr/share."""
CRATES = Path("/usr/share/cargo/registry/reqwest-0.11.13")
CARGO = """[package]
name = "openapi"
version = "0.1.0"
edition = "2021"
[dependencies]
serde = { version = "1", features = ["derive"] }
serde_json = "1"
serde_repr = "0.1"
url = "2"
tokio = { version = "1", features = ["fs", "macros", "rt"] }
tokio-util = { version = "0.7", features = ["codec"] }
reqwest = { version = "0.11", default-features = false, features = ["json", "multipart", "stream"] }
"""
"""What a generated Rust client asks for, in the versions that Debian has."""
STAND_INS = {
    "javax/annotation/Generated": "@interface Generated { String value(); String comments(); }",
    "javax/annotation/Nonnull": "@interface Nonnull {}",
    "javax/annotation/Nullable": "@interface Nullable {}",
    "org/openapitools/client/RFC3339JavaTimeModule": "class RFC3339JavaTimeModule "
    "extends com.fasterxml.jackson.databind.module.SimpleModule {}",
    "com/fasterxml/jackson/datatype/jsr310/JavaTimeModule": "class JavaTimeModule "
    "extends com.fasterxml.jackson.databind.module.SimpleModule {}",
}
"""What a generated Java client wants beside Jackson: markers, and a module for dates, which the API has none of."""

needs_java = pytest.mark.skipif(shutil.which("java") is None, reason="no JDK is installed")
needs_npm = pytest.mark.skipif(shutil.which("npm") is None, reason="no npm is installed")


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    service = Service(access_log=False)
    try:
        service.wait_until_ready()
        yield service
    finally:
        service.close()


def run(*command: object, folder: Path, **environment: str) -> str:
    """Run a command in `folder` and return what it prints; fail with all of it if it fails."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    if "PYTHONPATH" in environment:
        environment["PYTHONPATH"] += os.pathsep + os.environ.get("PYTHONPATH", "")
    environment = {**os.environ, "PATH": path, **environment}
    done = subprocess.run(
        [str(word) for word in command], cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.full
@needs_java
def test_java_http_client_with_its_defaults(service: Service, tmp_path: Path) -> None:
    """It offers h2c with every request, body included."""
    printed = run("java", CALLS / "Call.java", service.url, folder=tmp_path)
    assert printed.split() == ["201", "200", "[false,true,true]"]


@pytest.mark.full
@pytest.mark.skipif(
    importlib.util.find_spec("openapi_python_client") is None, reason="openapi-python-client is missing"
)
def test_openapi_python_client(service: Service, tmp_path: Path) -> None:
    words = ("--path", DOCUMENT, "--output-path", "generated", "--meta", "none")
    run(sys.executable, "-m", "openapi_python_client", "generate", *words, folder=tmp_path)
    printed = run(sys.executable, CALLS / "call_openapi_python_client.py", service.url, folder=tmp_path, PYTHONPATH=".")
    assert printed.split() == ["201", "[False,True,True]", "touching", "422"]


def generate(folder: Path, language: str, *words: str) -> Path:
    """Make a client of the stored document by openapi-generator."""
    package = pytest.importorskip("openapi_generator_cli", reason="openapi-generator-cli is missing")
    program = next(Path(package.__file__).parent.glob("*.jar"))
    words = ("generate", "-g", language, "-i", str(DOCUMENT), "-o", "generated", *words)
    run("java", "-jar", program, *words, folder=folder)
    return folder / "generated"


def run_typescript(service: Service, folder: Path, call: str, *packages: str) -> str:
    """Compile and run one of the calls in `folder`, where its client was generated."""
    run("npm", "install", "--silent", "--no-audit", "--no-fund", "typescript@5.9", *packages, folder=folder)
    shutil.copy(CALLS / call, folder / "call.ts")
    options = ("--strict", "--target", "es2022", "--module", "nodenext", "--skipLibCheck", "--lib", "es2022,dom")
    (folder / "package.json").write_text('{"type": "module"}')
    run("npx", "tsc", *options, "call.ts", folder=folder)
    return run("node", "call.js", service.url, folder=folder)


@pytest.mark.full
@needs_npm
def test_openapi_typescript(service: Service, tmp_path: Path) -> None:
    packages = ("openapi-typescript@7", "openapi-fetch@0.14", "typescript@5.9")
    run("npm", "install", "--silent", "--no-audit", "--no-fund", *packages, folder=tmp_path)
    run("npx", "openapi-typescript", DOCUMENT, "-o", "api.d.ts", folder=tmp_path)
    assert run_typescript(service, tmp_path, "call.ts", *packages).split() == ANSWERS


@pytest.mark.full
@needs_java
@needs_npm
def test_openapi_generator_typescript_fetch(service: Service, tmp_path: Path) -> None:
    generate(tmp_path, "typescript-fetch", "-p", "importFileExtension=.js")
    assert run_typescript(service, tmp_path, "call_openapi_generator.ts").split() == ANSWERS


@pytest.mark.full
@needs_java
def test_openapi_generator_python(service: Service, tmp_path: Path) -> None:
    pytest.importorskip("dateutil", reason="python-dateutil is missing")
    pytest.importorskip("urllib3", reason="urllib3 is missing")
    folder = generate(tmp_path, "python")
    printed = run(sys.executable, CALLS / "call_openapi_generator.py", service.url, folder=folder, PYTHONPATH=".")
    assert printed.lower().split() == ANSWERS


@pytest.mark.full
@needs_java
@pytest.mark.skipif(not all(path.exists() for path in JACKSON), reason="no libjackson2-databind-java is installed")
def test_openapi_generator_java(service: Service, tmp_path: Path) -> None:
    # without the first, lists that may be left out are sent as empty ones, which ask for nothing
    options = "containerDefaultToNull=true,openApiNullable=false,dateLibrary=legacy,hideGenerationTimestamp=true"
    folder = generate(tmp_path, "java", "--library", "native", "-p", options)
    sources = folder / "src" / "main" / "java"
    (sources / "org" / "openapitools" / "client" / "RFC3339InstantDeserializer.java").unlink()
    for name, text in STAND_INS.items():
        path = sources / f"{name}.java"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"package {name.rpartition('/')[0].replace('/', '.')};\npublic {text}\n")
    libraries = os.pathsep.join(map(str, JACKSON))
    classes = tmp_path / "classes"
    words = ("-nowarn", "-d", classes, "-cp", libraries, CALLS / "CallGenerated.java", *sources.rglob("*.java"))
    run("javac", *words, folder=tmp_path)
    printed = run("java", "-cp", f"{classes}{os.pathsep}{libraries}", "CallGenerated", service.url, folder=tmp_path)
    assert printed.split() == ANSWERS


@pytest.mark.full
@needs_java
@pytest.mark.skipif(shutil.which("go") is None, reason="no Go is installed")
def test_openapi_generator_go(service: Service, tmp_path: Path) -> None:
    if not (GO_PATH / "src" / "gopkg.in" / "validator.v2").exists():
        pytest.skip("no golang-gopkg-validator.v2-dev is installed")
    folder = tmp_path / "src"
    folder.mkdir()
    shutil.rmtree(generate(folder, "go") / "test")
    places = {"GO111MODULE": "off", "GOPATH": f"{tmp_path}{os.pathsep}{GO_PATH}", "GOCACHE": str(tmp_path / "cache")}
    printed = run("go", "run", CALLS / "call_openapi_generator.go", service.url, folder=folder, **places)
    assert printed.split() == ANSWERS


@pytest.mark.full
@needs_java
@pytest.mark.parametrize(
    ("language", "call", "program", "words"),
    [
        ("ruby", "call_openapi_generator.rb", "ruby", ("-I", "lib")),
        ("php", "call_openapi_generator.php", "php", ()),
    ],
)
def test_openapi_generator_ruby_and_php(
    service: Service, tmp_path: Path, language: str, call: str, program: str, words: tuple[str, ...]
) -> None:
    if shutil.which(program) is None or not [*Path("/usr/share").glob(SHARED[language])]:
        pytest.skip(f"no {program} with Debian's {SHARED[language]} is installed")
    folder = generate(tmp_path, language)
    shutil.copy(CALLS / call, folder)
    assert run(program, *words, call, service.url, folder=folder).split() == ANSWERS


@pytest.mark.full
@needs_java
@pytest.mark.skipif(not CRATES.exists() or shutil.which("cargo") is None, reason="no cargo with Debian's reqwest")
def test_openapi_generator_rust(service: Service, tmp_path: Path) -> None:
    """Its enum of solids writes `type` itself: the field of that name, which each solid has too, is taken out."""
    folder = generate(tmp_path, "rust")
    for path in (folder / "src" / "models").glob("*_solid.rs"):
        text = re.sub(r' *///[^\n]*\n *#\[serde\(rename = "type"\)\]\n *pub r#type: Type,\n', "", path.read_text())
        path.write_text(text.replace("r#type: Type, ", "").replace("r#type,", ""))
    (folder / "Cargo.toml").write_text(CARGO)
    (folder / ".cargo").mkdir()
    (folder / ".cargo" / "config.toml").write_text(
        f'[source.crates-io]\nreplace-with = "debian"\n[source.debian]\ndirectory = "{CRATES.parent}"\n'
    )
    shutil.copy(CALLS / "call_openapi_generator.rs", folder / "src" / "main.rs")
    printed = run("cargo", "run", "--offline", "--quiet", "--", service.url, folder=folder, RUSTFLAGS="-Awarnings")
    assert printed.split() == ANSWERS[1:]  # the status of what went well is not told


@pytest.mark.full
@needs_npm
@pytest.mark.parametrize(
    ("call", "package", "command"),
    [
        ("call_hey_api.ts", "@hey-api/openapi-ts@0.99", "openapi-ts -i {document} -o generated"),
        (
            "call_swagger_typescript_api.ts",
            "swagger-typescript-api@13",
            "swagger-typescript-api generate -p {document} -o generated -n api.ts",
        ),
        ("call_orval.ts", "orval@7", "orval --input {document} --output generated.ts --client fetch"),
    ],
)
def test_more_generators_of_typescript(service: Service, tmp_path: Path, call: str, package: str, command: str) -> None:
    packages = (package, "typescript@5.9", "esbuild@0.25")
    run("npm", "install", "--silent", "--no-audit", "--no-fund", *packages, folder=tmp_path)
    run("npx", *command.format(document=DOCUMENT).split(), folder=tmp_path)
    shutil.copy(CALLS / call, tmp_path / "call.ts")
    options = "--noEmit --strict --target es2022 --module esnext --moduleResolution bundler --skipLibCheck"
    run("npx", "tsc", *options.split(), "--lib", "es2022,dom,dom.iterable", "call.ts", folder=tmp_path)
    bundle = "--bundle --platform=node --format=esm --log-level=error --outfile=call.mjs"
    run("npx", "esbuild", "call.ts", *bundle.split(), folder=tmp_path)
    printed = run("node", "call.mjs", service.url, folder=tmp_path).split()
    assert printed[0] in ("200", "201")
    assert printed[1:4] == ANSWERS[1:]
    assert printed[4:] in ([], ["[-1,0,1]"])  # the binary call too
