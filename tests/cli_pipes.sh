#!/bin/sh
# SPDX-License-Identifier: MIT
# Pipes carry the same bytes as files, and reports do not get between them.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
cd "$work" || exit 1

"$fathom" scene city a.npy --size 20,30,10 --quiet || bad "scene"
"$fathom" scene city - --size 20,30,10 >b.npy || bad "scene to a pipe"
cmp -s a.npy b.npy || bad "a scene through a pipe differs"

"$fathom" transform a.npy field.npy --quiet || bad "transform"
"$fathom" transform - - <a.npy >piped.npy 2>report || bad "transform through pipes"
cmp -s field.npy piped.npy || bad "a field through pipes differs"
grep -q '^total ' report || bad "the report is not on stderr: $(cat report)"
"$fathom" transform - - --quiet <a.npy 2>report >piped.npy || bad "quiet transform through pipes"
[ ! -s report ] || bad "--quiet says: $(cat report)"
"$fathom" scene city - --size 20,30,10 | "$fathom" transform - - --quiet | "$fathom" convert - last.npy --quiet || bad "a chain of pipes"
cmp -s field.npy last.npy || bad "a field through a chain differs"

# Other formats come through a pipe when they are named, and pictures go into one.
"$fathom" convert a.npy a.raw --quiet || bad "convert to raw"
"$fathom" transform - - --shape 20,30,10 --input-type u8 --quiet <a.raw >piped.npy || bad "raw through a pipe"
cmp -s field.npy piped.npy || bad "a field of raw voxels through a pipe differs"
"$fathom" slice a.npy a.png --quiet || bad "slice"
"$fathom" slice - - <a.npy >piped.png 2>report || bad "a picture into a pipe"
cmp -s a.png piped.png || bad "a picture through a pipe differs"
"$fathom" info - <a.npy | grep -q '20 x 30 x 10' || bad "info of a pipe"

mkfifo fifo
cat fifo >drained.npy &
reader=$!
"$fathom" transform a.npy fifo --format npy --quiet || bad "transform to a FIFO"
wait "$reader"
cmp -s field.npy drained.npy || bad "a field through a FIFO differs"
[ -p fifo ] || bad "the FIFO was replaced"

"$fathom" transform a.npy /dev/null --quiet || bad "transform to /dev/null"
[ -c /dev/null ] || bad "/dev/null was replaced"

: | "$fathom" transform - out.npy 2>error
[ $? = 1 ] || bad "an empty pipe is not refused"
[ "$(wc -l <error)" = 1 ] || bad "an empty pipe says: $(cat error)"
head -c 500 a.npy | "$fathom" transform - out.npy 2>error
[ $? = 1 ] || bad "a pipe that ends early is not refused"
[ ! -e out.npy ] || bad "a failed read left an output"

# A reader that goes away ends the program; it neither hangs nor leaves anything.
"$fathom" scene full - --size 128 | head -c 1 >first
[ "$(find . -name '*tmp*' | wc -l)" = 0 ] || bad "temporary files are left: $(ls)"
finish
