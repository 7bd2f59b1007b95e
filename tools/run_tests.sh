#!/bin/sh
# Run the tests in two processes side by side: what computes, with coverage, and what waits for nodes.
# Usage: tools/run_tests.sh PYTHON UNITS...   (UNITS are the folders whose coverage is measured)
set -u
python=$1
shift
nodes="tests/nodes tests/ros tests/sim_bridge tests/test_readme_walk.py"
mkdir -p build
"$python" -m pytest $nodes >build/tests_of_nodes.log 2>&1 &
beside=$!
trap 'kill $beside 2>/dev/null' INT TERM

"$python" -m coverage run -m pytest "$@"
units=$?
ignored=""
for each in "$@" $nodes; do ignored="$ignored --ignore=$each"; done
"$python" -m pytest tests $ignored
rest=$?

wait $beside
of_nodes=$?
cat build/tests_of_nodes.log
[ "$units" -eq 0 ] && [ "$rest" -eq 0 ] && [ "$of_nodes" -eq 0 ]
