#!/bin/sh
# SPDX-License-Identifier: MIT
# Ctrl-C and SIGTERM in the middle of a write leave nothing behind.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
cd "$work" || exit 1
env --default-signal=INT true 2>/dev/null || skip "this env cannot restore SIGINT, which a shell ignores in the background"

"$fathom" scene sparse a.npy --size 160 --quiet || bad "scene"
mkdir out

# Compression makes the write last long enough to be met.
stop_by() {
    env --default-signal=INT "$fathom" transform a.npy out/field.npy.gz --quiet &
    writer=$!
    tries=0
    while [ -z "$(ls -A out)" ] && [ "$tries" -lt 3000 ]; do
        tries=$((tries + 1))
        sleep 0.01
    done
    [ ! -e out/field.npy.gz ] || bad "the write was over before SIG$1 could be sent"
    kill "-$1" "$writer"
    wait "$writer"
    code=$?
    # As the shell tells of a death by signal.
    [ "$code" = "$2" ] || bad "SIG$1 ends with $code, not $2"
    [ -z "$(ls -A out)" ] || bad "SIG$1 left $(ls -A out)"
}

stop_by INT 130
stop_by TERM 143

# A name that was there before keeps its contents.
echo kept >out/field.npy.gz
env --default-signal=INT "$fathom" transform a.npy out/field.npy.gz --quiet &
writer=$!
tries=0
while [ "$(ls -A out | wc -l)" -lt 2 ] && [ "$tries" -lt 3000 ]; do
    tries=$((tries + 1))
    sleep 0.01
done
kill -INT "$writer"
wait "$writer"
[ "$(cat out/field.npy.gz)" = kept ] || bad "an interrupted write changed what was there"
[ "$(ls -A out)" = field.npy.gz ] || bad "an interrupted write left $(ls -A out)"

# Between two outputs: the first, which is complete, must not be there without the second.
rm out/field.npy.gz
env --default-signal=INT "$fathom" transform a.npy out/field.npy.gz --indices out/indices.npy --quiet &
writer=$!
tries=0
while [ "$(ls -A out | wc -l)" -lt 2 ] && [ "$tries" -lt 3000 ]; do
    tries=$((tries + 1))
    sleep 0.01
done
kill -INT "$writer"
wait "$writer"
[ -z "$(ls -A out)" ] || bad "SIGINT between two outputs left $(ls -A out)"
finish
