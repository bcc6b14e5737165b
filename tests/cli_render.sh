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

# Comments, blank lines, lines' ends of another system, and a view that widens and narrows: it stays within its keys.
printf '\n  # a flight\r\n0,0,30,45,-40,20 # begin\r\n\n\t10,0,30,60,-40,170\t\n20,10,30,90,-40,170\n20,10,30,90,-90,1 # ends\n' >"$work/keys"
ends 0 render town.npy --backend cpu --size 32x18 --path 40 --keys keys --out f.png -q
rm "$work"/f00*.png
printf '0,0,30,45,-40\n1,2,3\n' >"$work/bad"
ends 2 render town.npy --path 2 --keys bad --out f.png
says 'line 2 of --keys'
for line in 'nan,0,0,0,0' '1e30,0,0,0,0' '0,0,0,0,91' '0,0,0,0,0,180' '0,0,0,0,0,60,1' '0,0,0,0,0 1' '0;0;0;0;0'; do
    printf '# first\n%s\n' "$line" >"$work/bad"
    ends 2 render town.npy --path 2 --keys bad --out f.png
    says 'line 2 of --keys'
done
printf '0,0,0,\0000,0\n' >"$work/bad"
ends 2 render town.npy --path 2 --keys bad --out f.png
says 'line 1 of --keys'
head -c 100000 /dev/zero | tr '\0' '1' >"$work/bad"
ends 2 render town.npy --path 2 --keys bad --out f.png
says 'line 1 of --keys'
yes 0,0,0,0,0 | head -1025 >"$work/bad"
ends 2 render town.npy --path 2 --keys bad --out f.png
says 'line 1025 of --keys'
printf '# nothing\n' >"$work/bad"
ends 2 render town.npy --path 2 --keys bad --out f.png
says 'no line'
ends 2 render town.npy --path 2 --keys . --out f.png
says 'cannot be read'
rm "$work/bad"
holds keys town.npy

# Films. An ffmpeg that fails leaves nothing, nor does one that is not there.
mkdir "$work/bin"
# shellcheck disable=SC2016
printf '#!/bin/sh\nfor last; do :; done\necho part >"${last#file:}"\nhead -c 100 >/dev/null\nexit 3\n' >"$work/bin/ffmpeg"
chmod +x "$work/bin/ffmpeg"
(cd "$work" && PATH=$work/bin:$PATH "$fathom" render town.npy --backend cpu --size 33x17 --path 3 --out film.mp4 -q) 2>"$work/.err"
[ $? = 1 ] || bad "a film by an ffmpeg that fails"
says 'ffmpeg'
rm "$work/bin/ffmpeg"
(cd "$work" && PATH=$work/bin "$fathom" render town.npy --backend cpu --size 33x17 --path 3 --out film.mp4 -q) 2>"$work/.err"
[ $? = 1 ] || bad "a film without ffmpeg"
says 'not installed'
rmdir "$work/bin"
holds keys town.npy

# $1 file; $2 what ffprobe says of it: width, height, frames.
film_has() {
    told=$(cd "$work" && ffprobe -v error -count_frames -select_streams v -show_entries stream=width,height,nb_read_frames \
        -of csv=p=0 "file:$1")
    [ "$told" = "$2" ] || bad "$1 is $told, not $2"
}

if command -v ffmpeg >/dev/null && command -v ffprobe >/dev/null; then
    ends 0 render town.npy --backend cpu --size 33x17 --path 5 --out=-a:b.mp4 -q
    film_has -a:b.mp4 34,18,5
    ends 0 render town.npy --backend cpu --size 64x36 --path 4 --fps 12.5 --keys keys --out film.webm -q
    film_has film.webm 64,36,4
    holds -a:b.mp4 film.webm keys town.npy
    rm "$work/-a:b.mp4" "$work/film.webm"
    for signal in INT TERM; do
        # Through env, for a shell starts what is in the background with SIGINT ignored.
        (cd "$work" && exec env --default-signal=INT "$fathom" render town.npy --backend cpu --size 640x360 --path 100000 \
            --out film.mp4 -q) 2>"$work/.err" &
        child=$!
        tries=0
        until ls "$work"/film.mp4.*.part >/dev/null 2>&1 || [ $tries = 200 ]; do
            sleep 0.05
            tries=$((tries + 1))
        done
        kill -s $signal $child
        wait $child
        status=$?
        [ $status -gt 128 ] || bad "a film ended by $signal: exit status $status"
        [ $tries -lt 200 ] || bad "a film made no part in ten seconds"
        holds keys town.npy
    done
else
    echo "no films were made: ffmpeg and ffprobe are not installed"
fi

# What is refused, and how.
ends 2 render town.npy
says 'give --out FILE'
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
[ "$(cut -d, -f5-9 <"$work/r.csv" | sort -u | wc -l)" -gt 4 ] || bad "cases: $(cat "$work/r.csv")"
head -1 "$work/r.csv" | grep -q '^scene,x,y,z,width,height,format,mode,march,device,gpu_ms' || bad "header: $(head -1 "$work/r.csv")"
head -1 "$work/r.csv" | grep -q ',beam_bytes,march_bytes,.*,checked,wrong,memory,' || bad "header: $(head -1 "$work/r.csv")"
grep -q '"frames_per_second"' "$work/r.json" || bad "JSON: $(cat "$work/r.json")"
[ "$(grep -c '"wrong":	0' "$work/r.json")" = 20 ] || bad "wrong pixels: $(cat "$work/r.json")"
grep -q '"checked":	0' "$work/r.json" && bad "no pixel was checked: $(cat "$work/r.json")"
# Without a measurement there are counts, but neither times nor a verdict, here nor where there is a target.
ends 0 bench render --backend cpu --size 12 --picture 24x16 --cameras 2 --rounds 0 --scene city --format packed --march skip \
    --csv n.csv --json n.json
grep -q 'nothing is timed' "$work/.out" || bad "no word that nothing is timed: $(cat "$work/.out")"
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
    { gsub(/"[^"]*"/, "x"); for (name in at) if (name ~ /_ms$|_ms_|second$/ && $at[name] != "") exit 1 }
    { if ($at["verdict"] != "" || ($at["steps_per_ray"] == "") != ($at["mode"] == "edited")) exit 1 }' "$work/n.csv" ||
    bad "not only counts: $(cat "$work/n.csv")"
[ "$(grep -c '"frames_per_second":	null' "$work/n.json")" = 3 ] || bad "times: $(cat "$work/n.json")"
grep -q 'verdict' "$work/n.json" && bad "a verdict: $(cat "$work/n.json")"
# Pictures that are timed with edits have times of their own, and no counts.
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next } { gsub(/"[^"]*"/, "x") }
    $at["mode"] == "edited" && ($at["gpu_ms_median_ms"] == "" || $at["update_ms_median_ms"] == "" || $at["steps_per_ray"] != "") {
    exit 1 }' "$work/r.csv" || bad "edited: $(cat "$work/r.csv")"
ends 2 bench render --mode fast
ends 2 bench render --cameras 2000

finish
