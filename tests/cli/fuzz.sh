#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A campaign of the readers' fuzz target with AddressSanitizer: tests/cli/fuzz.sh [SECONDS [CORPUS_FOLDER]]. Needs clang.
# Seeds are the small files of the shared test data, if they are there, one for each name ending; new inputs go to CORPUS_FOLDER.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
seconds=${1:-300}
corpus=${2:-$root/build/fuzz-corpus}
shared=${DELMESH_SHARED:-$root/../shared}
mkdir -p "$corpus"
i=0
for ending in obj off ply stl; do
    for file in "$shared"/data/malformed/*."$ending" "$shared"/data/nasty/*."$ending"; do
        [ -f "$file" ] && [ "$(wc -c <"$file")" -lt 4000 ] || continue
        { printf "\\$(printf %03o "$i")"; cat "$file"; } >"$corpus/seed-$(basename "$file")"
    done
    i=$((i + 1))
done
cmake -S "$root" -B "$root/build/fuzz" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ -DDELMESH_FUZZ=ON \
    -DCMAKE_BUILD_TYPE=RelWithDebInfo -DDELMESH_SANITIZE=address,undefined -DDELMESH_BENCH=OFF -DDELMESH_EXAMPLES=OFF >/dev/null
cmake --build "$root/build/fuzz" --target cli_fuzz_readers
cd "$corpus/.."
exec "$root/build/fuzz/tests/cli/cli_fuzz_readers" "$corpus" -max_total_time="$seconds" -max_len=4096 -timeout=5 \
    -rss_limit_mb=1024
