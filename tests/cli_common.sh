# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Sourced by the cli_*.sh tests: a scratch directory, and checks of how a command ends.

fathom=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' INT TERM
failures=0

bad() {
    echo "failed: $*" >&2
    failures=$((failures + 1))
}

finish() {
    if [ "$failures" -gt 0 ]; then
        echo "$failures checks failed" >&2
        exit 1
    fi
    echo "all checks passed"
    exit 0
}

skip() {
    echo "skipped: $*"
    exit 77
}

# ends CODE ARGUMENTS...: runs fathom in $work; a failure must say one line "fathom: ..." and print nothing else.
ends() {
    wanted=$1
    shift
    (cd "$work" && "$fathom" "$@") >"$work/.out" 2>"$work/.err" </dev/null
    got=$?
    [ "$got" = "$wanted" ] || bad "exit code $got, not $wanted: fathom $*: $(cat "$work/.err")"
    if [ "$wanted" = 0 ]; then
        return
    fi
    [ "$(wc -l <"$work/.err")" = 1 ] || bad "not one line on stderr: fathom $*: $(cat "$work/.err")"
    grep -q '^fathom: ' "$work/.err" || bad "no 'fathom: ' on stderr: fathom $*: $(cat "$work/.err")"
    [ ! -s "$work/.out" ] || bad "a failure printed on stdout: fathom $*"
}

# says TEXT: the last message has it.
says() {
    grep -q -- "$1" "$work/.err" || bad "the message lacks \"$1\": $(cat "$work/.err")"
}

# holds NAME...: $work has these files and no others (names that begin with a dot aside, but for temporary files).
holds() {
    there=$(cd "$work" && find . -mindepth 1 -maxdepth 1 ! -name .out ! -name .err | sed 's|^\./||' | LC_ALL=C sort | tr '\n' ' ')
    expected=$(printf '%s\n' "$@" | LC_ALL=C sort | tr '\n' ' ')
    [ "$there" = "$expected" ] || bad "files are: $there; expected: $expected"
}
