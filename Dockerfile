# STAGES names the stages that go in; without it, the image of the router and of the `deixis` command. So a robot holds its
# camera alone. All share the layers up to ARG STAGES. Needs no BuildKit.
#   docker build --build-arg STAGES=camera --tag deixis-camera .

FROM python:3.11-slim-bookworm AS wheels
RUN pip install --quiet --no-cache-dir --root-user-action ignore hatchling
COPY schemas /source/schemas
COPY runtime /source/runtime
COPY cli /source/cli
COPY services /source/services
RUN pip wheel --quiet --no-cache-dir --no-build-isolation --no-deps --wheel-dir /wheels \
    /source/schemas /source/runtime /source/cli /source/services/*

FROM python:3.11-slim-bookworm
ENV PYTHONUNBUFFERED=1 \
    # As deixis_runtime.environment has it.
    OPENBLAS_NUM_THREADS=1 \
    MALLOC_ARENA_MAX=1 \
    MALLOC_MMAP_THRESHOLD_=67108864 \
    MALLOC_TRIM_THRESHOLD_=134217728
# What others wrote has a layer of its own, so that a change of ours is a small download. What is needed, and in which
# version, say the distributions and constraints.txt; pip below adds whatever is missing here.
COPY constraints.txt /tmp/constraints.txt
RUN pip install --quiet --no-cache-dir --root-user-action ignore -c /tmp/constraints.txt \
    cryptography eclipse-zenoh mcap msgpack numpy "opencv-python-headless<5" pydantic pyyaml rich setproctitle
COPY --from=wheels /wheels /wheels
RUN pip install --quiet --no-cache-dir --root-user-action ignore -c /tmp/constraints.txt \
    /wheels/deixis_schemas-*.whl "$(echo /wheels/deixis_runtime-*.whl)[images]" /wheels/deixis_cli-*.whl
# The socket and the registry live in volumes, which take the owner of the folders they cover.
RUN useradd --uid 10001 --no-create-home --home-dir /var/lib/deixis deixis \
    && install --directory --owner deixis /run/deixis /var/lib/deixis
COPY config /etc/deixis
WORKDIR /var/lib/deixis
CMD ["python", "-m", "deixis_runtime.router", "--config", "/etc/deixis/edge.json5", \
     "--listen", "unixsock-stream//run/deixis/router.sock"]
ARG STAGES=
RUN for stage in $STAGES; do set -- "$@" /wheels/deixis_$stage-*.whl; done; [ $# -eq 0 ] \
    || pip install --quiet --no-cache-dir --root-user-action ignore -c /tmp/constraints.txt "$@"
USER deixis
