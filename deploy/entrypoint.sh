#!/bin/sh
# Runs a command of the image, which finds its decision code compiled.
#
# The compiler writes to a folder, and nothing else of the image need be writeable. So
# what was compiled for the image is linked from there; what is missing is compiled anew.
set -eu

compiled=${ENCORE_COMPILED:-/opt/encore/compiled}
: "${NUMBA_CACHE_DIR:=/tmp/numba}"
export NUMBA_CACHE_DIR

# One kind of code for all processors of the last ten years, not one for the builder's.
if [ "$(uname -m)" = x86_64 ] && grep -qw avx2 /proc/cpuinfo; then
    export NUMBA_CPU_NAME="${NUMBA_CPU_NAME-x86-64-v3}"
    export NUMBA_CPU_FEATURES="${NUMBA_CPU_FEATURES-}"
fi

if [ -d "$compiled" ] && [ ! -e "$NUMBA_CACHE_DIR" ]; then
    cp -rs "$compiled" "$NUMBA_CACHE_DIR"
fi
exec "$@"
