# The first stage installs from the hashed lock and compiles the decision code; the
# second holds the result, and nothing to build with.
FROM python:3.13-slim AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 \
    PIP_NO_CACHE_DIR=1
RUN python -m venv --without-pip /opt/encore
WORKDIR /src
COPY requirements.lock ./
RUN pip --python /opt/encore/bin/python install \
    --require-hashes --only-binary :all: -r requirements.lock
COPY pyproject.toml README.md LICENSE ./
COPY app ./app
COPY learning ./learning
COPY migrations ./migrations
COPY policies ./policies
COPY simulation ./simulation
RUN pip --python /opt/encore/bin/python install --no-deps --no-build-isolation .
COPY deploy/entrypoint.sh /usr/local/bin/encore-entrypoint
# Away from the sources: what is compiled belongs to the files that are installed.
WORKDIR /
RUN NUMBA_CACHE_DIR=/opt/encore/compiled encore-entrypoint \
    /opt/encore/bin/python -c "from app.services.warming import warm_up; warm_up()"

FROM python:3.13-slim
LABEL org.opencontainers.image.title="Encore" \
    org.opencontainers.image.description="Online recommendation for catalogues that people come back to" \
    org.opencontainers.image.licenses="Apache-2.0"
RUN install -d -o 65534 -g 65534 /data
COPY --from=build /opt/encore /opt/encore
COPY deploy/entrypoint.sh /usr/local/bin/encore-entrypoint
ENV PATH=/opt/encore/bin:$PATH \
    NUMBA_CACHE_DIR=/tmp/numba \
    PYTHONDONTWRITEBYTECODE=1 \
    PYTHONUNBUFFERED=1 \
    ENCORE_HOST=0.0.0.0 \
    ENCORE_PORT=8000
USER 65534:65534
# The default database, sqlite:///encore.db, is kept here.
WORKDIR /data
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=60s \
    CMD ["python", "-IS", "-c", "import os, urllib.request as r; r.urlopen(f\"http://127.0.0.1:{os.environ['ENCORE_PORT']}/health/ready\", timeout=4)"]
ENTRYPOINT ["encore-entrypoint"]
CMD ["encore", "serve"]
