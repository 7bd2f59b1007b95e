#!/bin/bash
# tools/set_up.sh VENV LOCK [OPTION OF venv...]
# Makes the virtual environment VENV with what LOCK pins, and this project in it, editable.
set -euo pipefail
venv=$1 lock=$2
shift 2

fail() {
  echo "set-up: $1" >&2
  exit 1
}

supported='import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))'
python=
for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
  if "$candidate" -c "$supported" 2>/dev/null; then
    python=$candidate
    break
  fi
done
[ -n "$python" ] || fail "no Python 3.11, 3.12 or 3.13 found; install one: sudo apt-get install python3 python3-venv"
"$python" -c 'import venv, ensurepip' 2>/dev/null ||
  fail "$python has no module venv; install it: sudo apt-get install python3-venv"

packages=$(grep -c == "$lock")
echo "set-up: $venv with $packages locked packages ($("$python" --version), once, a minute or two)"
"$python" -m venv --clear "$@" "$venv"
pip="$venv/bin/python -m pip --disable-pip-version-check --no-input"
every=$([ -t 1 ] && echo 1 || echo 30)
$pip install --progress-bar off -r "$lock" | awk -v all="$packages" -v every="$every" '
  /^(Collecting|Requirement already satisfied:)/ && ++n % every == 0 && n <= all {
    printf "%sset-up: %d of %d packages%s", every == 1 ? "\r" : "", n, all, every == 1 ? "" : "\n"
    fflush()
  }
  /^Installing collected/ { printf "%sset-up: installing\n", every == 1 ? "\r\033[K" : ""; fflush() }'
$pip install --quiet --no-deps --no-build-isolation --editable .
