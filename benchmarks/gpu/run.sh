#!/bin/bash
# Measures engines with many worlds on this machine's GPU, with this machine's Python, without a network:
#
#   benchmarks/gpu/run.sh --out DIR [--seconds 720] [--parts DIR] [--models DIR] [more options of run.py]
#
# --parts has packages that this Python lacks, as parts.py makes them; those whose parts are not all there are left out. Results in DIR are
# written one by one. The same command again goes on where this one stopped.
set -u
here=$(cd "$(dirname "$0")" && pwd)
scratch=${ASSAY_GPU_SCRATCH:-${TMPDIR:-/tmp}/assay-gpu}
parts=
rest=()
while [ $# -gt 0 ]; do
  case $1 in
    --parts) parts=$2; shift 2 ;;
    *) rest+=("$1"); shift ;;
  esac
done
python=${PYTHON:-python3}
command -v "$python" > /dev/null || { echo "no '$python' is here: name one in PYTHON" >&2; exit 2; }
mkdir -p "$scratch"
if [ -n "$parts" ]; then
  for file in "$parts"/*.json; do
    name=$(basename "$file" .json)
    site=$scratch/site
    [ "$name" = newton ] && site=$scratch/newton  # its MuJoCo is another version
    "$python" "$here/parts.py" join "$parts" "$site" "$name" || echo "$name is left out"
  done
fi
export PYTHONPATH=$scratch/site${PYTHONPATH:+:$PYTHONPATH}
exec "$python" "$here/run.py" --scratch "$scratch" --newton-site "$scratch/newton" "${rest[@]}"
