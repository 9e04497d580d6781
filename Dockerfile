# The service as a small image: no root, no shell tools needed, kernels compiled at build.
# tests/unit/test_dockerfile.py runs the same steps in a temporary folder, since no image is built in its tests.
#
#   docker build -t exact-geometry .
#   docker run --read-only --tmpfs /tmp -p 8000:8000 exact-geometry

FROM python:3.12-slim AS build

# Code compiled for one family of CPUs runs on all of them; an older CPU compiles for itself.
# x86-64-v3: Haswell (2013) and later, AMD Excavator and later. For ARM: --build-arg CPU=generic
ARG CPU=x86-64-v3

WORKDIR /src
COPY pyproject.toml hatch_build.py README.md LICENSE ./
COPY engine engine
COPY service service
COPY exact_geometry exact_geometry
COPY benchmarks benchmarks

RUN python -m venv /opt/exact-geometry
RUN /opt/exact-geometry/bin/pip install --no-cache-dir ".[formats,mcp,telemetry]"
# with what was installed, not with the sources in this folder (-P); then again, as the wheel with these kernels
RUN /opt/exact-geometry/bin/python -P -m exact_geometry warm --into /src/kernels --cpu $CPU
RUN EXACT_GEOMETRY_KERNELS=/src/kernels /opt/exact-geometry/bin/pip install --no-cache-dir --no-deps --force-reinstall .

FROM python:3.12-slim

# kernels are read from the package; what the CPU cannot run is compiled into a place that can be written: a tmpfs will do
ENV ENGINE_CACHE_DIR=/tmp/kernels HOME=/tmp
ENV PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1
ENV GEOMETRY_HOST=0.0.0.0 GEOMETRY_PORT=8000

COPY --from=build /opt/exact-geometry /opt/exact-geometry

USER 10001:10001
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=3s --start-period=60s CMD ["/opt/exact-geometry/bin/python", "-c", "import urllib.request as r; r.urlopen('http://127.0.0.1:8000/readyz', timeout=2)"]
CMD ["/opt/exact-geometry/bin/python", "-m", "service"]
