#!/bin/bash
# Resolves requirements/*.in into requirements/*.lock, for all supported Pythons at once.
set -euo pipefail
cd "$(dirname "$0")/../requirements"
uv_venv=../build/uv
[ -x $uv_venv/bin/uv ] || { python3 -m venv $uv_venv && $uv_venv/bin/pip install --quiet uv; }

compile() {
  output=$1
  shift
  "$uv_venv/bin/uv" pip compile --quiet --upgrade --universal --python-version 3.11 \
    --fork-strategy fewest --no-header --no-annotate \
    --output-file "$output" "$@"
}
compile wheels.lock project.in ros.in
compile system-ros.lock project.in oldest.in colcon.in
compile oldest.lock project.in ros.in oldest.in
compile site.lock site.in
