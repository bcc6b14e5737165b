#!/bin/sh
# SPDX-License-Identifier: MIT
# Meshes on the command line.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' >"$work/a.obj"
ends 0 info a.obj
grep -q 'closed, 1 component$' "$work/.out" || bad "info does not say that the tetrahedron is closed"
grep -q 'volume *0.166666' "$work/.out" || bad "info does not tell the volume"
gzip -k "$work/a.obj"
ends 0 info a.obj.gz --json
! command -v python3 >/dev/null || python3 - "$work/.out" <<'END' || bad "the JSON of a mesh is not what it should be"
import json, sys
m = json.load(open(sys.argv[1]))
assert m["kind"] == "mesh" and m["format"] == "OBJ" and m["compressed"]
assert m["triangles"] == m["vertices"] == m["distinct"] == 4 and m["closed"] and m["components"] == 1
assert m["boundary"] == m["non_manifold"] == m["misoriented"] == m["degenerate"] == m["intersections"] == 0
assert m["low"] == [0, 0, 0] and m["high"] == [1, 1, 1] and abs(m["volume"] - 1 / 6) < 1e-9
END
printf '# nothing\n' >"$work/empty.obj"
ends 0 info empty.obj
ends 0 info empty.obj --json
printf 'v 0 0 0\nf 1 2 3\n' >"$work/bad.obj"
ends 1 info bad.obj
says 'bad.obj: line 2'
finish
