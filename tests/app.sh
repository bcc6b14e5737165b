#!/bin/sh
# SPDX-License-Identifier: MIT
# The painting program in a real window on a virtual screen, driven by keys and mouse, with the validation layer on.
# shellcheck source=tests/app_common.sh
. "$(dirname "$0")/app_common.sh"

open_screen
start_program --validation --scene terrain --size 32 --pixels 4 --window 1100x820 --pictures "$work" --backend "${APP_BACKEND:-vulkan}"
voxels made
first_solid=$solid
first_hash=$hash
[ "$first_solid" -gt 1000 ] || bad "the scene has $first_solid solid voxels"
expect "the first frame" '^picture 275 205$'
picture start

# Fly.
settle
now
xdotool mousemove --window "$window" 800 600 click 1
expect "a click into the picture" '^captured 1$'
[ "$(value '^aim' 2)" = 1 ] || bad "nothing is under the cross-hair"
# Taps, each of which moves for a frame, whatever that takes: a key that is held goes as far as the machine is slow.
for key in w a s d space shift q e; do
    now
    xdotool key $key
    expect "key $key" '^camera '
done
settle
before=$(value '^camera' 6)
now
xdotool mousemove_relative -- 20 10
expect "the mouse" '^camera .*yaw'
[ "$before" != "$(printf '%s' "$line" | cut -d ' ' -f 6)" ] || bad "the mouse does not turn: $line"
settle
[ "$(value '^aim' 2)" = 1 ] || bad "nothing is ahead any longer: $(grep '^aim' "$log" | tail -n 1)"

# Radius and colour.
now
xdotool click 5
expect "the wheel" '^settings .*radius=3 '
now
xdotool key 3
expect "a number key" '^settings .*color=orange '

# Place and delete, take back and do again.
now
xdotool click 1
voxels placed
placed_hash=$hash
[ "$solid" -gt "$first_solid" ] || bad "placing left $solid solid voxels of $first_solid"
placed=$solid
picture placed
now
xdotool click 3
voxels deleted
deleted_hash=$hash
[ "$solid" -lt "$placed" ] || bad "deleting left $solid solid voxels of $placed"
now
xdotool key ctrl+z
voxels undone
[ "$hash" = "$placed_hash" ] || bad "undo does not restore what was before the deletion"
now
xdotool key ctrl+z
voxels undone
[ "$hash" = "$first_hash" ] || bad "undo does not restore the scene"
now
xdotool key ctrl+y
voxels redone
[ "$hash" = "$placed_hash" ] || bad "redo does not place again"
now
xdotool key ctrl+y
voxels redone
[ "$hash" = "$deleted_hash" ] || bad "redo does not delete again"

# Pictures.
now
xdotool key F12
expect "F12" '^screenshot '
file=$(printf '%s' "$line" | cut -d ' ' -f 2)
[ "$(identify -format '%wx%h' "$file")" = 275x205 ] || bad "the screenshot is no picture of 275x205: $file"

# Save and load, by keys and by buttons.
now
xdotool key Tab
expect "Tab" '^captured 0$'
name_file world.npy
press save
expect "Save" '^saved world.npy$'
saved_hash=$deleted_hash
press undo
voxels undone
[ "$hash" != "$saved_hash" ] || bad "the button does not undo"
press redo
voxels redone
[ "$hash" = "$saved_hash" ] || bad "the button does not do again"
press undo
voxels undone
now
xdotool key ctrl+o
voxels loaded
[ "$hash" = "$saved_hash" ] || bad "what is loaded is not what was saved"
name_file world.vox
now
xdotool key ctrl+s
expect "Ctrl+S, in the text even" '^saved world.vox$'
count=$solid
press load
voxels loaded
[ "$solid" = "$count" ] || bad "world.vox brings $solid solid voxels back, not $count"
expect "the file in the place of the scene" '^settings scene=world.vox size=32x32x32 '
name_file no/such/file.vox
press load
expect "a file that is not there" '^failed load: no/such/file.vox'

# The window.
now
xdotool windowsize "$window" 900 700
expect "a smaller window" '^picture 2[0-9]* 1[0-9]*$'
picture small
now
xdotool windowminimize "$window"
expect "minimising" '^hidden$'
now
xdotool windowmap "$window"
expect "the window again" '^shown$'
now
xdotool windowsize "$window" 1100 820
expect "a larger window" '^picture 275 205$'
settle
now
xdotool key F1
expect "F1" '^panel 0$'
settle
picture bare
now
xdotool key F1
expect "F1" '^widget scene '

# A key that is held goes on.
now
xdotool mousemove --window "$window" 800 600 click 1
expect "a click into the picture" '^captured 1$'
now
xdotool keydown s
expect "a key" '^camera '
now
expect "a key that is held" '^camera '
xdotool keyup s

end_program

# Pictures that fail are told of once, and the window goes on.
export FATHOM_PAINT_BROKEN=12
start_program --validation --scene terrain --size 32 --pixels 4 --window 1100x820 --backend "${APP_BACKEND:-vulkan}"
unset FATHOM_PAINT_BROKEN
expect "a picture that fails" '^failed picture: the picture is 0 x '
expect "the panel without a picture" '^widget scene '
expect "pictures again" '^mended$'
settle
[ "$(grep -c '^failed' "$log")" -lt 4 ] || bad "a picture that fails is told of $(grep -c '^failed' "$log") times"
[ "$(value '^aim' 2)" = 1 ] || bad "nothing is ahead of pictures that are mended"
end_program

# The clock of a benchmark stands still while it is minimised: less than 1.5 of its 4 seconds would be left otherwise.
start_program --size 32 --pixels 4 --auto-edit 5 --seconds 4 --csv late.csv --backend "${APP_BACKEND:-vulkan}"
now
xdotool windowminimize "$window"
expect "minimising" '^hidden$'
sleep 2.5
now
xdotool windowmap "$window"
expect "the benchmark's window again" '^shown$'
wait_end
shown=$(awk -F, 'NR > 1 { ms += $3 } END { print (ms > 2200) }' "$work/late.csv")
[ "$shown" = 1 ] || bad "a benchmark that was minimised has no frames for its time: $(cat "$work/said")"
grep -q '^hidden for [2-9][.0-9]* s, ' "$work/said" || bad "the time that a benchmark was minimised: $(cat "$work/said")"
# The table of one that cannot be written is told of before it begins.
"$paint" --size 32 --auto-edit 5 --seconds 1000 --csv "$work/no/such/file.csv" >"$work/said" 2>&1 && bad "a table in no directory is taken"
grep -q 'no/such/file.csv' "$work/said" || bad "a table in no directory: $(cat "$work/said")"

# The benchmark in a window ends by itself.
: >"$log"
(cd "$work" && exec "$paint" --log "$log" --validation --size 32 --pixels 2 --shadow soft --no-vsync --auto-edit 5 --interval 0 --frames 20 --csv frames.csv \
    --backend "${APP_BACKEND:-vulkan}") >"$work/said" 2>&1 || bad "the benchmark: $(cat "$work/said")"
grep -q '^20 frames, 20 edits, seed 5, an edit a frame$' "$work/said" || bad "the summary: $(cat "$work/said")"
[ "$(wc -l <"$work/frames.csv")" = 21 ] || bad "the table of 20 frames has $(wc -l <"$work/frames.csv") lines"
grep -q '^quit validation 0$' "$log" || bad "validation messages: $(grep -m 3 validation "$work/said")"
# Field and picture are within their frame, and by the clock, where the picture is made by the processor too, no small part of it.
told=$(awk -F, 'NR > 1 { frame += $3; work += $5 + $6; over += $5 + $6 > $3 } END { print (over == 0) (work > frame / 10), work, frame }' "$work/frames.csv")
case $told in
11*) ;;
10*) grep -q '^march and field by the clock' "$work/said" && bad "of the frames' time field and picture have too little: $told" ;;
*) bad "field and picture take longer than their frames: $told" ;;
esac
finish
