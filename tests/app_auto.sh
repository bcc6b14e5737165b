#!/bin/sh
# SPDX-License-Identifier: MIT
# The painting program's benchmark, without a window: the same seed brings the same edits and pictures, on either backend.
paint=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' INT TERM
failures=0
# No window system can be reached.
unset DISPLAY WAYLAND_DISPLAY

bad() {
    echo "failed: $*" >&2
    failures=$((failures + 1))
}

# benchmark NAME OPTIONS...
benchmark() {
    name=$1
    shift
    "$paint" --headless --scene terrain --size 32 --window 160x120 --frames 6 --interval 0 --radius 6 --last-frame "$work/$name.png" \
        --csv "$work/$name.csv" "$@" >"$work/$name.out" 2>"$work/$name.err"
}

benchmark cpu --backend cpu --auto-edit 7 || bad "on the CPU: $(cat "$work/cpu.err")"
benchmark again --backend cpu --auto-edit 7 || bad "again: $(cat "$work/again.err")"
benchmark other --backend cpu --auto-edit 8 || bad "another seed: $(cat "$work/other.err")"
benchmark plain --backend cpu --auto-edit 7 --march plain || bad "without a field: $(cat "$work/plain.err")"
cmp -s "$work/cpu.png" "$work/again.png" || bad "the same seed brings another picture"
cmp -s "$work/cpu.png" "$work/other.png" && bad "another seed brings the same picture"
cmp -s "$work/cpu.png" "$work/plain.png" || bad "the field changes the picture"
[ "$(wc -l <"$work/cpu.csv")" = 7 ] || bad "the table of 6 frames has $(wc -l <"$work/cpu.csv") lines"
head -n 1 "$work/cpu.csv" | grep -qx 'frame,start_ms,delta_ms,fps,field_ms,march_ms,edits' || bad "the table's head: $(head -n 1 "$work/cpu.csv")"
grep -q '^6 frames, 6 edits, seed 7, an edit a frame$' "$work/cpu.out" || bad "the summary: $(cat "$work/cpu.out")"
for row in 'delta ms' 'march ms' 'field ms' 'frames/s'; do
    grep -q "^$row  *6 " "$work/cpu.out" || bad "the summary has no $row of 6 frames"
done

# An interval on the clock, for some time.
"$paint" --headless --scene city --size 32 --window 64x64 --auto-edit 1 --interval 100 --seconds 0.45 --backend cpu >"$work/clock.out" 2>&1 ||
    bad "by the clock: $(cat "$work/clock.out")"
grep -q ' [1-5] edits, seed 1, an edit every 100 ms$' "$work/clock.out" || bad "edits by the clock: $(cat "$work/clock.out")"

# A focus that stays, and one that goes with the camera.
benchmark stays --backend cpu --auto-edit 7 --algorithm selective --chunk 8 --focus 1 --focus-at 4,4,4 || bad "a focus that stays: $(cat "$work/stays.err")"
benchmark goes --backend cpu --auto-edit 7 --algorithm selective --chunk 8 --focus 1 || bad "a focus: $(cat "$work/goes.err")"

# What is refused.
"$paint" --headless --auto-edit 1 --algorithm exact --chunk 16 >"$work/out" 2>&1
[ $? = 2 ] || bad "--chunk is taken for an exact field"
"$paint" --headless --auto-edit 1 --last-frame "$work/x.jpg" >"$work/out" 2>&1
[ $? = 2 ] || bad "a picture that is no PNG is taken"
"$paint" --headless >"$work/out" 2>&1
[ $? = 2 ] || bad "--headless alone is taken"
"$paint" --csv "$work/x.csv" >"$work/out" 2>&1
[ $? = 2 ] || bad "--csv without --auto-edit is taken"
benchmark none --auto-edit 1 --backend cpu --csv "$work/no/such/file.csv" 2>/dev/null && bad "a table that cannot be written is no failure"
"$paint" --size 32 >"$work/out" 2>&1 && bad "a window opens without a window system"
grep -q -e '--headless' "$work/out" || bad "a missing window system is not explained: $(cat "$work/out")"

if benchmark vulkan --backend vulkan --auto-edit 7 --validation; then
    cmp -s "$work/cpu.png" "$work/vulkan.png" || bad "the backends' pictures differ"
elif ! grep -q '^fathom: no usable Vulkan device\|^fathom: no Vulkan' "$work/vulkan.err"; then
    bad "on Vulkan: $(cat "$work/vulkan.err")"
fi
if [ "$failures" -gt 0 ]; then
    echo "$failures checks failed" >&2
    exit 1
fi
echo "all checks passed"
