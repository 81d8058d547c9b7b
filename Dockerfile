# The first stage installs from the hashed lock and compiles the decision code; the
# second holds the result, and nothing to build with.
FROM python:3.13-slim AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 \
    PIP_NO_CACHE_DIR=1 \
    NUMBA_CACHE_DIR=/opt/encore/numba
RUN python -m venv /opt/encore
WORKDIR /src
COPY requirements.lock ./
RUN /opt/encore/bin/pip install --require-hashes -r requirements.lock
COPY pyproject.toml README.md LICENSE ./
COPY app ./app
COPY learning ./learning
COPY migrations ./migrations
COPY policies ./policies
COPY simulation ./simulation
RUN /opt/encore/bin/pip install --no-deps --no-build-isolation .
# Away from the sources: what is compiled belongs to the files that are installed.
WORKDIR /
RUN /opt/encore/bin/python -c "from app.services.warming import warm_up; warm_up()"

FROM python:3.13-slim
COPY --from=build /opt/encore /opt/encore
# On a processor unlike the builder's, code is compiled anew: its folder is writeable.
RUN install -d -o 65534 -g 65534 /data && chown -R 65534:65534 /opt/encore/numba
ENV PATH=/opt/encore/bin:$PATH \
    NUMBA_CACHE_DIR=/opt/encore/numba \
    PYTHONUNBUFFERED=1 \
    ENCORE_HOST=0.0.0.0 \
    ENCORE_PORT=8000 \
    ENCORE_DATABASE_URL=sqlite:////data/encore.db
USER 65534:65534
WORKDIR /data
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=60s CMD ["python", "-c", "import os, urllib.request as r; r.urlopen(f\"http://127.0.0.1:{os.environ['ENCORE_PORT']}/health/ready\", timeout=4)"]
CMD ["encore", "serve"]
