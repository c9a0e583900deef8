# Both base images are arguments. They may come from a mirror, have digests (docs/supply-chain.md), or
# be root file systems with Node and Python 3.11 (tools/deploy/image.py).
ARG NODE_IMAGE=node:24.19.0-bookworm-slim
ARG PYTHON_IMAGE=python:3.11.14-slim-bookworm


# The scripts of / are bundled, and those of /docs come from the npm registry. The secrets, here and
# below, may configure other registries; the image does not contain these secrets.
FROM ${NODE_IMAGE} AS web
WORKDIR /source/web
COPY web/.npmrc web/package.json web/package-lock.json ./
RUN --mount=type=secret,id=npmrc,target=/root/.npmrc \
    npm ci
COPY web/build.mjs ./
COPY service/api/page ../service/api/page
COPY clients/typescript/src ../clients/typescript/src
RUN npm run build


# The service and the packages that it imports are in /app. pip is in /tools, which is not copied.
FROM ${PYTHON_IMAGE} AS build
ARG EXTRAS=cluster,meshopt,rhino
ARG SOURCE_DATE_EPOCH=0
RUN python3 -m venv /tools && python3 -m venv --without-pip /app
WORKDIR /source
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY service service
COPY --from=web \
    /source/web/node_modules/swagger-ui-dist/swagger-ui-bundle.js \
    /source/web/node_modules/swagger-ui-dist/swagger-ui.css \
    /source/web/node_modules/swagger-ui-dist/NOTICE \
    /source/web/node_modules/swagger-ui-dist/LICENSE \
    service/api/static/swagger-ui/
COPY --from=web /source/service/api/static/page service/api/static/page
# Only wheels, so that no package except the service runs code while it is installed.
RUN --mount=type=secret,id=pip.conf,target=/etc/pip.conf \
    PIP_CONSTRAINT=constraints.txt \
    /tools/bin/pip --python /app/bin/python install --no-cache-dir --no-compile \
        --only-binary :all: ".[${EXTRAS}]"
# Removes files that the service does not need: tests, stubs, sources and headers of compiled parts,
# scripts, records of pip. Bytecode is not checked against its source, because an image is never
# edited; so two builds are equal.
RUN find /app -depth \( \
        -type d \( -name tests -o -name include \) \
        -o -name '*.pyi' -o -name '*.pyx' -o -name '*.pxd' -o -name '*.h' -o -name '*.a' \
        -o -path '/app/bin/*' ! -name 'python*' ! -name surface ! -name dask \
        -o -name direct_url.json -o -name REQUESTED \
    \) -exec rm -rf {} + \
    && /app/bin/python -m compileall -q --invalidation-mode unchecked-hash /app/lib


FROM ${PYTHON_IMAGE}
# Removes the pip of the base image, because nothing is installed into a running container.
RUN rm -rf /usr/local/bin/pip* /usr/local/lib/python3*/ensurepip /usr/local/lib/python3*/site-packages/*
COPY --from=build /app /app
# The service writes only to this folder: stored surfaces. A new volume gets the folder's owner.
RUN install --directory --owner=10001 --group=10001 --mode=0700 /data
# BLAS uses one thread: the matrices are small, and requests are computed in parallel already.
ENV PATH=/app/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 \
    PYTHONUNBUFFERED=1 \
    OPENBLAS_NUM_THREADS=1 \
    SURFACE_HOST=0.0.0.0 \
    SURFACE_LOG_FORMAT=json \
    SURFACE_STORE=/data
USER 10001:10001
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s --retries=3 \
    CMD ["/app/bin/surface", "health", "--live"]
ENTRYPOINT ["/app/bin/surface"]
CMD ["serve"]
# These are last, so that another commit uses the cached layers above.
ARG VERSION=0.1.0
ARG REVISION=unknown
ARG CREATED=1970-01-01T00:00:00Z
LABEL org.opencontainers.image.title="Surface Service" \
      org.opencontainers.image.description="Parametric surfaces in, meshes out." \
      org.opencontainers.image.licenses="Apache-2.0" \
      org.opencontainers.image.version="${VERSION}" \
      org.opencontainers.image.revision="${REVISION}" \
      org.opencontainers.image.created="${CREATED}"
