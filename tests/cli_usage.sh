#!/bin/sh
# SPDX-License-Identifier: MIT
# Bad usage ends with 2 and one line; help and version end with 0.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

ends 0 help
ends 0 --help
ends 0 version
grep -q '^fathom [0-9]*\.[0-9]*\.[0-9]*$' "$work/.out" || bad "version prints $(cat "$work/.out")"
for command in transform sdf voxelize info slice convert scene devices world render bench; do
    ends 0 "$command" --help
    grep -q "^usage: fathom $command" "$work/.out" || bad "$command --help has no usage line"
    ends 0 help "$command"
done
ends 0 devices
grep -q '^cpu: ' "$work/.out" || bad "devices does not list the CPU"
ends 0 scene --list
ends 0 bench transform --list-engines

ends 2
ends 2 nonsense
ends 2 help nonsense
ends 2 version extra
ends 2 devices extra
ends 2 info
ends 2 transform
ends 2 transform a.npy
says 'missing argument OUT'
ends 2 transform a.npy b.npy c.npy
ends 2 transform a.npy b.npy --nonsense
ends 2 transform a.npy b.npy --metric l3
says 'l2, l1, linf'
ends 2 transform a.npy b.npy --algorithm magic
ends 2 transform a.npy b.npy --outside green
ends 2 transform a.npy b.npy --backend cuda
ends 2 transform a.npy b.npy --type f64
ends 2 transform a.npy b.npy --type i16
says -- '--signed'
ends 2 transform a.npy b.npy --type u8 --signed
ends 2 transform a.npy b.npy --metric
ends 2 transform a.npy b.npy --spacing 1,2
ends 2 transform a.npy b.npy --spacing 1,2,x
ends 2 transform a.npy b.npy --spacing 1,0,1
ends 2 transform a.npy b.npy --spacing 1,1,1 --type u8
ends 2 transform a.npy b.npy --max-distance 0
ends 2 transform a.npy b.npy --max-distance -3
ends 2 transform a.npy b.npy --max-distance nan
ends 2 transform a.npy b.npy --threshold abc
ends 2 transform a.npy b.npy --label 1.5
ends 2 transform a.npy b.npy --label 99999999999999999999
ends 2 transform a.npy b.npy --threshold 1 --label 1
ends 2 transform a.npy b.npy --squared --metric l1
ends 2 transform a.npy b.npy --backend cpu --device 0
ends 2 transform a.npy b.npy --threads 0
ends 2 transform a.npy b.npy --threads two
ends 2 transform a.npy b.npy --indices b.npy
ends 2 transform a.npy b.npy --slice b.npy
ends 2 transform a.npy b.npy --slice -
ends 2 transform a.raw b.npy --shape 2,2,2
ends 2 transform a.raw b.npy --input-type u8
ends 2 transform a.raw b.npy --shape 2,2 --input-type u8
ends 2 transform a.raw b.npy --shape 0,2,2 --input-type u8
ends 2 transform a.raw b.npy --shape 2,2,4294967296 --input-type u8
ends 2 transform a.raw b.npy --shape 2,2,2 --input-type u9
ends 2 transform a.raw b.npy --shape 2,2,2 --input-type u8 --offset -1
ends 2 transform a.raw b.npy --shape 2,2,2 --input-type u8 --input-format npy
ends 2 transform a.raw b.npy --format jpeg
ends 2 scene terrain
ends 2 scene terrain out.npy
ends 2 scene nowhere out.npy --size 8
says 'terrain, sparse'
ends 2 scene terrain out.npy --size 0
ends 2 scene terrain out.npy --size 8,8
ends 2 scene terrain out.npy --size -8
ends 2 scene terrain out.npy --size 8 --seed x
ends 2 scene sparse out.npy --size 8 --density 0
ends 2 scene sparse out.npy --size 8 --density 1.5
ends 2 slice a.npy
ends 2 slice a.npy b.jpg
says 'end the name in .png'
ends 2 transform a.npy b.npy --slice b.jpg
ends 2 slice a.npy b.png --axis w
ends 2 slice a.npy b.png --index -1
ends 2 slice a.npy b.png --min 3 --max 3
ends 2 slice a.npy b.png --map rainbow
ends 2 slice a.npy b.png --scale 0
ends 2 convert a.npy
ends 2 bench
ends 2 bench nonsense
ends 2 bench transform --sizes 8,
ends 2 bench transform --sizes none
ends 2 bench transform --scenes nowhere
ends 2 bench transform --engines nothing
ends 2 bench transform --metrics l9
ends 2 bench transform --types u64
ends 2 bench transform --inputs f32
ends 2 bench transform --runs 1
ends 2 bench transform --runs 100000
# A name that would break the line is made harmless.
ends 2 "$(printf 'two\nlines')"

[ -z "$(ls "$work")" ] || bad "bad usage left files: $(ls "$work")"
finish
