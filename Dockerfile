# Both base images are arguments, so that another root file system with Node or Python can stand in.
ARG NODE_IMAGE=node:24-slim
ARG PYTHON_IMAGE=python:3.11-slim


# The scripts of / and /docs, from the npm registry: served by the service itself.
FROM ${NODE_IMAGE} AS web
WORKDIR /web
COPY web/.npmrc web/package.json web/package-lock.json web/three.js ./
RUN npm ci && npm run build


# The service and what it imports, compiled to bytecode, in /app; pip stays behind in /tools.
FROM ${PYTHON_IMAGE} AS build
RUN python3 -m venv /tools && python3 -m venv --without-pip /app
WORKDIR /source
COPY pyproject.toml constraints.txt README.md ./
COPY service service
COPY --from=web \
    /web/node_modules/swagger-ui-dist/swagger-ui-bundle.js \
    /web/node_modules/swagger-ui-dist/swagger-ui.css \
    /web/node_modules/swagger-ui-dist/NOTICE \
    /web/node_modules/swagger-ui-dist/LICENSE \
    service/api/static/swagger-ui/
COPY --from=web \
    /web/build/three.js \
    /web/node_modules/three/LICENSE \
    service/api/static/three/
# NumPy brings its own tests, 15 MB that nobody runs here.
RUN /tools/bin/pip --python /app/bin/python install --no-cache-dir --constraint constraints.txt '.[meshopt]' \
    && find /app -type d -name tests -prune -exec rm -rf {} +


FROM ${PYTHON_IMAGE}
LABEL org.opencontainers.image.title="Surface Service" \
      org.opencontainers.image.description="Parametric surfaces in, meshes out."
# Nothing is installed into a running container: the base image's pip goes too.
RUN rm -rf /usr/local/bin/pip* /usr/local/lib/python3*/ensurepip /usr/local/lib/python3*/site-packages/*
COPY --from=build /app /app
# All that is ever written: the stored surfaces. A new volume takes over the owner of the folder.
RUN install --directory --owner=10001 --group=10001 --mode=0700 /data
# One process, one BLAS thread: replicas scale the service, not threads.
ENV PATH=/app/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 \
    PYTHONUNBUFFERED=1 \
    OPENBLAS_NUM_THREADS=1 \
    SURFACE_HOST=0.0.0.0 \
    SURFACE_STORE=/data
USER 10001:10001
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s --retries=3 \
    CMD ["python", "-c", "import urllib.request as u; u.urlopen('http://127.0.0.1:8000/health/live', timeout=2)"]
ENTRYPOINT ["surface"]
CMD ["serve"]
