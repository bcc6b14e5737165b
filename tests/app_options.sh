#!/bin/sh
# SPDX-License-Identifier: MIT
# Every choice of the painting program's panel, made with the mouse in a window on a virtual screen, with the validation layer on.
# shellcheck source=tests/app_common.sh
. "$(dirname "$0")/app_common.sh"

open_screen
start_program --validation --scene terrain --size 64 --pixels 4 --window 640x820 --backend "${APP_BACKEND:-vulkan}"
voxels made
picture options
first_hash=$hash

# World.
open_list size 32
press size/32
voxels made
[ "$hash" != "$first_hash" ] || bad "a smaller world is the same"
expect "the size" '^settings .*size=32x32x32 '
first_hash=$hash
for scene in city sparse empty air terrain; do
    open_list scene air
    press "scene/$scene"
    voxels made
    case $scene in
    air | empty) [ "$solid" = 0 ] || bad "there are $solid solid voxels in $scene" ;;
    terrain) [ "$hash" = "$first_hash" ] || bad "terrain is not the same again" ;;
    *) [ "$solid" -gt 0 ] || bad "nothing is in $scene" ;;
    esac
done
for format in split-u8 split-u16 squared packed; do
    choose format $format format
done

# Algorithms, with the world in one piece and in chunks.
for algorithm in brute-force fim jfa-published jfa jfa-1+ jfa+2 jfa-fim published-final; do
    choose algorithm $algorithm algorithm
done
choose algorithm jfa-fim algorithm
for chunk in 8 16; do
    choose chunk $chunk chunk
done
for border in halo exchange; do
    choose border $border border
done
for convergence in host device; do
    choose convergence $convergence convergence
done
choose border padding border
choose algorithm jfa-published algorithm
now
before=$mark
choose border halo border
mark=$before
expect "the share of wrong pixels" '^wrong '
settle
picture approximate
choose border padding border
choose algorithm selective algorithm
for focus in 1 3; do
    choose focus $focus focus
done
choose algorithm exact algorithm

# What cannot be is refused, and taken back.
choose format squared format
open_list algorithm fim
press algorithm/fim
expect "a field of squares by fim" '^failed algorithm: '
choose format packed format

# The picture.
for march in box plain skip; do
    choose march $march march
done
for view in steps normal distance slice difference color; do
    choose view $view view
    [ -z "${APP_PICTURES:-}" ] || { settle && picture "view-$view"; }
done
for shadow in hard soft none; do
    choose shadow $shadow shadow
done
for pixels in 2 1 4; do
    choose pixels $pixels pixels
done
for check in occlusion preview vsync crosshair; do
    was=$(grep '^settings' "$log" | tail -n 1 | sed "s/.* $check=\([01]\) .*/\1/")
    press $check
    expect "$check" "^settings .* $check=$((1 - was)) "
    press $check
    expect "$check again" "^settings .* $check=$was "
done
for color in red grey white; do
    press color/$color
    [ $color = white ] || expect "the color $color" "^settings .*color=$color "
done
press radius
expect "the radius" '^settings .*radius='
was=$(grep '^settings' "$log" | tail -n 1 | sed 's/.* speed=\([0-9.]*\) .*/\1/')
press speed
expect "the speed" '^settings .* speed='
case $line in
*" speed=$was "*) bad "the speed stays at $was" ;;
esac
grep -v -e '^failed algorithm: ' "$log" | grep '^failed' && bad "something failed that should not"

press quit
wait_end

# A slice that the world has across one axis and not across another.
start_program --validation --size 96,96,24 --view slice --pixels 4 --window 640x820 --backend "${APP_BACKEND:-vulkan}"
voxels made
choose across x across
press slice
expect "the slice" '^settings .*across=x slice=[3-9][0-9] '
choose across z across
expect "a slice of the world" '^settings .*across=z slice=23 '
picture slice
grep '^failed' "$log" && bad "a slice failed"
end_program
finish
