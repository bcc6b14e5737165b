#!/bin/sh
# SPDX-License-Identifier: MIT
# NanoVDB files in the hands of NanoVDB's and OpenVDB's own programs: every value and which voxels are active.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

for tool in nanovdb_validate nanovdb_convert nanovdb_print; do
    command -v "$tool" >/dev/null || skip "there is no $tool (Debian: libnanovdb-tools)"
done
# OpenVDB's module belongs to the system's Python.
python=/usr/bin/python3
"$python" -c 'import numpy, pyopenvdb' 2>/dev/null || skip "there are no numpy and pyopenvdb (Debian: python3-numpy python3-openvdb)"

cat >"$work/make.py" <<'END'
import numpy as np
def save(name, v): np.save(name, np.ascontiguousarray(v, dtype=np.float32))
z, y, x = np.mgrid[0:160, 0:180, 0:290].astype(np.float32)
r = np.sqrt((x - 150) ** 2 + (y - 90) ** 2 + (z - 70) ** 2) - 77
save("ball.npy", np.clip(r, -3, 3))        # tiles of the inside, of leaves' size and of lower nodes'
save("inside.npy", np.clip(-r, -3, 3))     # inside up to the border
save("full.npy", r[60:80, :90, :70])
u = np.abs(r[:40, :40, :40]); u[3, 4, 5] = np.inf
save("unsigned.npy", u)
n = np.full((3, 5, 9000), 2, np.float32); n[:, :, 4090:4100] = -1; n[1, 1, 8190:] = 0.5
save("long.npy", n)
save("none.npy", np.full((20, 20, 20), -4))
save("one.npy", np.full((1, 1, 1), 0.25))
END
cat >"$work/compare.py" <<'END'
import sys, numpy as np, pyopenvdb as vdb
name, band = sys.argv[1], float(sys.argv[2])
d = np.load(name + ".npy").transpose(2, 1, 0)
g = vdb.read(name + ".vdb", "distance")
assert g.background == np.float32(band), g.background
on = np.abs(d) < np.float32(band)
assert g.activeVoxelCount() == on.sum(), (g.activeVoxelCount(), on.sum())
a = np.zeros(d.shape, np.float32)
g.copyToArray(a)
assert np.array_equal(a, np.where(on, d, np.copysign(np.float32(band), d)))
seen = np.zeros(d.shape, bool)
for item in g.citerOnValues():
    assert item.min == item.max
    seen[item.min] = True
assert np.array_equal(seen, on)
t = g.transform
assert np.allclose(t.voxelSize(), float(sys.argv[3]))
assert (g.gridClass == "level set") == bool((d < 0).any())
END
(cd "$work" && "$python" make.py) || bad "the fields could not be made"

# $1 field, $2 band: background that its file must have, $3 spacing.
check() {
    ends 0 convert "$1.npy" "$1.nvdb" --quiet
    (cd "$work" && nanovdb_validate -v "$1.nvdb") >"$work/.out" 2>&1 && grep -q passed "$work/.out" ||
        bad "nanovdb_validate: $1: $(cat "$work/.out")"
    (cd "$work" && nanovdb_print "$1.nvdb") >"$work/.out" 2>&1 && grep -q "distance" "$work/.out" || bad "nanovdb_print: $1"
    (cd "$work" && nanovdb_convert -f "$1.nvdb" "$1.vdb") >/dev/null 2>&1 || bad "nanovdb_convert: $1"
    (cd "$work" && "$python" compare.py "$1" "$2" "$3") || bad "$1 is not the same in OpenVDB"
}
check ball 3 1
check inside 3 1
check long 2 1
check one 0.25 1
check none 4 1
check unsigned "$(cd "$work" && "$python" -c 'import numpy as n; v = n.load("unsigned.npy"); print(repr(float(v[n.isfinite(v)].max())))')" 1
check full "$(cd "$work" && "$python" -c 'import numpy as n; print(repr(float(abs(n.load("full.npy")).max())))')" 1

# A spacing and an origin.
ends 0 scene shell s.npy --size 40 --quiet
ends 0 transform s.npy d.nrrd --signed --spacing 0.25,0.25,0.25 --quiet
ends 0 convert d.nrrd d.npy --quiet
ends 0 convert d.nrrd d.nvdb --quiet
(cd "$work" && nanovdb_convert -f d.nvdb d.vdb) >/dev/null 2>&1 || bad "nanovdb_convert: d"
(cd "$work" && "$python" compare.py d "$("$python" -c 'import numpy as n; print(repr(float(abs(n.load("d.npy")).max())))')" 0.25) ||
    bad "d is not the same in OpenVDB"

# What it refuses.
ends 1 convert s.npy s.nvdb
says 'float32'
ends 1 info d.nvdb
says 'only written'
finish
