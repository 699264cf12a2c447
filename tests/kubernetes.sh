#!/usr/bin/env bash
# The manifest of `ptm submit --kubernetes` against the schema of Kubernetes itself, by kubernetes-validate.
#
#   tests/kubernetes.sh PATH-OF-PTM
set -euo pipefail

ptm=$(realpath "$1")
root=$(cd "$(dirname "$0")/.." && pwd)
skip() { echo "SKIPPED: Kubernetes: $1"; exit 0; }
venv="$root/target/kubernetes-validate"
if [ ! -x "$venv/bin/kubernetes-validate" ]; then
    python3 -m venv "$venv" 2> /dev/null || skip "no python3 with venv"
    timeout 120 "$venv/bin/pip" install --quiet kubernetes-validate==1.37.0 2> /dev/null \
        || skip "kubernetes-validate cannot be installed"
fi
manifest=$(mktemp)
trap 'rm -f "$manifest"' EXIT
"$ptm" submit --kubernetes "$root/sweeps/smoke.toml" --data "a b.csv" --shards 250 --cores 4 \
    --image registry/ptm:1 --claim sweeps --out reports/smoke > "$manifest"
"$venv/bin/kubernetes-validate" --strict --kubernetes-version 1.37 "$manifest"
# And it would have noticed.
sed 's/"completions"/"completion"/' "$manifest" > "$manifest.wrong"
if "$venv/bin/kubernetes-validate" --quiet --strict --kubernetes-version 1.37 "$manifest.wrong" > /dev/null 2>&1; then
    rm -f "$manifest.wrong"
    echo "a manifest with a wrong key was let through"
    exit 1
fi
rm -f "$manifest.wrong"
