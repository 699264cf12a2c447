#!/usr/bin/env bash
# Fuzzes readers: so many seconds each, or with `Nx` so many executions. What crashes, hangs or swallows memory ends it.
#
#   tests/fuzz.sh SECONDS|Nx TARGET...
set -euo pipefail
cd "$(dirname "$0")/.."
amount=$1
shift
case $amount in
    *x) bound=-runs=${amount%x} ;;
    *) bound=-max_total_time=$amount ;;
esac
# cargo-fuzz wants flags that the stable compiler keeps to itself. Our code has no unsafe that a sanitizer would
# watch, so there is none; overflows and debug assertions are on.
export RUSTC_BOOTSTRAP=1
for target in "$@"; do
    corpus=fuzz/corpus/$target
    mkdir -p "$corpus"
    cargo fuzz run --sanitizer none "$target" "$corpus" "fuzz/seeds/$target" -- "$bound" \
        -max_len=4096 -timeout=20 -rss_limit_mb=2048 -malloc_limit_mb=1024 -print_final_stats=1 -verbosity=0
done
