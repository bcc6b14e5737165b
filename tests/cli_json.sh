#!/bin/sh
# SPDX-License-Identifier: MIT
# Every JSON output parses and has the fields that programs look for.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
command -v python3 >/dev/null || skip "there is no python3 to parse JSON with"

# has PYTHON-EXPRESSION: true of the JSON document d in the last output.
has() {
    python3 -c '
import json, sys
d = json.load(open(sys.argv[1]))
sys.exit(0 if eval(sys.argv[2]) else 1)' "${json:-$work/.out}" "$1" || bad "not so: $1: $(cat "${json:-$work/.out}")"
}

ends 0 devices --json
has 'd["devices"][0]["backend"] == "cpu" and d["devices"][0]["usable"] and all("reason" in x for x in d["devices"])'
ends 0 scene terrain 'a "b".npy' --size 20,10,5
ends 0 info 'a "b".npy' --json
has 'd["shape"] == [20, 10, 5] and d["type"] == "uint8" and d["format"] == "npy" and d["path"] == "a \"b\".npy"'
ends 0 transform 'a "b".npy' f.npy --json --backend cpu
has 'd["backend"] == "cpu" and d["device"]["kind"] == "host" and d["output"] == "f.npy" and d["spacing"] is None'
has 'd["any_solid"] and d["any_empty"]'
has 'len(d["passes"]) > 0 and all(p["milliseconds"] >= 0 and p["bytes"] > 0 for p in d["passes"]) and d["wall_milliseconds"] > 0'
ends 0 transform 'a "b".npy' f.npy --json --spacing 1,2,3 --metric l1 --signed --indices i.npy --slice s.png
has 'd["spacing"] == [1, 2, 3] and d["signed"] and d["metric"] == "l1" and d["indices"] == "i.npy" and d["slice"] == "s.png"'
ends 0 info 'a "b".npy' --json --stats
has 'd["stats"]["voxels"] == 1000 and d["stats"]["min"] == 0 and sum(v["voxels"] for v in d["stats"]["commonest"]) == 1000'
finish
