# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Pictures from the command line: files, statistics, paths, what is refused, and their benchmark. No time is judged.

# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

# The picture of a terrain, as a file and by its numbers.
ends 0 render scene:terrain:24 --size 96x54 --backend cpu --out a.png --stats
head -c 8 "$work/a.png" | od -An -c | grep -q 'P   N   G' || bad "a.png is no PNG"
grep -q '^5184 rays, [1-9]' "$work/.out" || bad "no rays: $(cat "$work/.out")"
grep -q 'wrong pixels .*: 0 (' "$work/.out" || bad "wrong pixels: $(cat "$work/.out")"

# A file, other cameras, views and methods.
ends 0 scene terrain --size 20 town.npy -q
ends 0 render town.npy --backend cpu --size 64x36 --camera -10,-10,30,45,-30,70 --view slice --slice y,3 --shadow none --out b.png -q
ends 0 render town.npy --backend cpu --size 64x36 --look-at 10,10,8,30,0,-45 --view steps --format squared --out c.png -q
ends 0 render town.npy --backend cpu --size 64x36 --march plain --ao off --sun 0,0,1 --crosshair --out d.png -q
ends 0 render town.npy --backend cpu --size 64x36 --algorithm fim --chunk 8 --view difference --stats
grep -q 'wrong pixels .*: 0 (' "$work/.out" || bad "a padded field made wrong pixels: $(cat "$work/.out")"
rm "$work"/*.png

# Paths: around, and along keys.
ends 0 render town.npy --backend cpu --size 32x18 --path 3 --out e.png -q
printf '# a flight\n0,0,30,45,-40\n10,0,30,60,-40,50\n20,10,30,90,-40\n' >"$work/keys"
ends 0 render town.npy --backend cpu --size 32x18 --path 2 --keys keys --out f.png -q
holds e0000.png e0001.png e0002.png f0000.png f0001.png keys town.npy
cmp -s "$work/e0000.png" "$work/e0001.png" && bad "the path does not move"
rm "$work"/*.png

# A film needs ffmpeg, and says so.
if command -v ffmpeg >/dev/null; then
    ends 0 render town.npy --backend cpu --size 33x17 --path 3 --out film.mp4 -q
    [ -s "$work/film.mp4" ] || bad "no film"
    rm -f "$work/film.mp4"
else
    ends 1 render town.npy --backend cpu --size 33x17 --path 3 --out film.mp4 -q
    says 'ffmpeg'
fi
holds keys town.npy

# What is refused, and how.
ends 2 render town.npy
says '--out or --stats'
ends 2 render scene:nowhere:8 --out a.png
says 'nowhere'
ends 2 render scene:terrain --out a.png
says 'scene:NAME:SIZE'
ends 2 render town.npy --camera 1,2,3 --out a.png
says 'YAW'
ends 2 render town.npy --look-at 1,2 --out a.png
says 'look-at'
ends 2 render town.npy --size 0x5 --out a.png
says 'WIDTHxHEIGHT'
ends 2 render town.npy --keys keys --out a.png
says '--path'
ends 2 render town.npy --view slice --slice w --out a.png
says 'slice'
ends 2 render town.npy --out a.jpg
says 'PNG'
ends 2 render town.npy --path 3 --out a.gif
says 'numbered'
ends 1 render none.npy --out a.png
says 'none.npy'
ends 1 render town.npy --backend cpu --view slice --slice z,20 --out a.png
says 'slice_index'
holds keys town.npy

# The benchmark.
ends 0 bench render --backend cpu --size 12 --picture 24x16 --cameras 4 --rounds 1 --frames 4 --warm-up 0 --csv r.csv --json r.json
[ "$(wc -l <"$work/r.csv")" = 21 ] || bad "not 20 cases: $(cat "$work/r.csv")"
head -1 "$work/r.csv" | grep -q '^scene,x,y,z,width,height,format,mode,march,device,gpu_ms' || bad "header: $(head -1 "$work/r.csv")"
grep -q '"frames_per_second"' "$work/r.json" || bad "JSON: $(cat "$work/r.json")"
ends 2 bench render --mode fast
ends 2 bench render --cameras 2000

finish
