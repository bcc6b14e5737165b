# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Sourced by app.sh: a virtual screen, the program in it, and what drives it by keys and mouse. What came of that is read from the
# program's log, of which `mark` lines have been seen.

paint=$1
work=$(mktemp -d)
log=$work/log
failures=0
mark=0
: "${APP_TIMEOUT:=180}"
# The validation layer leaks, and is unloaded before leaks are looked for, so that no suppression could name it. app_auto.sh
# looks for leaks.
export ASAN_OPTIONS="${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0"

server=""
manager=""
program=""
end_all() {
    for process in $program $manager $server; do
        kill "$process" 2>/dev/null
    done
    rm -rf "$work"
}
trap end_all EXIT
trap 'exit 1' HUP INT PIPE TERM

bad() {
    echo "failed: $*" >&2
    failures=$((failures + 1))
}

skip() {
    [ "${CI:-}" != true ] || { bad "$*" && exit 1; }
    echo "skipped: $*"
    exit 77
}

# give_up WHY: what follows would make no sense.
give_up() {
    bad "$@"
    echo "--- the end of the log:" >&2
    tail -n 5 "$log" >&2
    echo "--- what the program said:" >&2
    tail -n 20 "$work/said" >&2
    exit 1
}

open_screen() {
    for tool in Xvfb xdotool openbox import; do
        command -v $tool >/dev/null || skip "$tool is not installed"
    done
    mkfifo "$work/display"
    Xvfb -displayfd 3 -screen 0 1280x960x24 -nolisten tcp -noreset 3>"$work/display" 2>"$work/xvfb" &
    server=$!
    DISPLAY=:$(timeout 60 head -n 1 "$work/display")
    [ "$DISPLAY" != : ] || give_up "the virtual screen does not start: $(cat "$work/xvfb")"
    export DISPLAY
    HOME=$work openbox >"$work/openbox" 2>&1 &
    manager=$!
    # A window that is shown while the manager starts may never hear that it is visible, for which GLFW 3.3 waits for ever.
    for try in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
        xdotool get_num_desktops >/dev/null 2>&1 && return
        sleep 1
    done
    give_up "the window manager does not start after $try looks: $(cat "$work/openbox")"
}

# start_program OPTIONS...
start_program() {
    : >"$log"
    mark=0
    (cd "$work" && exec "$paint" --log "$log" "$@") >"$work/said" 2>&1 &
    program=$!
    wait_line '^ready ' || give_up "the program does not start"
    window=$(xdotool search --sync --onlyvisible --name '^Fathom$' | head -n 1)
    xdotool windowmove --sync "$window" 40 60 2>/dev/null
    xdotool windowfocus --sync "$window"
}

# wait_line PATTERN: until a line after the mark fits; `line` gets it. Fails when none comes.
wait_line() {
    waited=0
    until line=$(tail -n "+$((mark + 1))" "$log" | grep -m 1 -e "$1"); do
        if [ $waited -ge $((APP_TIMEOUT * 20)) ] || { [ -n "$program" ] && ! kill -0 "$program" 2>/dev/null; }; then
            line=""
            return 1
        fi
        sleep 0.05
        waited=$((waited + 1))
    done
}

# expect WHAT PATTERN
expect() {
    wait_line "$2" || give_up "$1: no line \"$2\" in the log"
}

# Forgets the lines so far: what is expected comes after this.
now() {
    mark=$(wc -l <"$log")
}

# The last word of the newest line that fits: value PATTERN FIELD, by number.
value() {
    grep -e "$1" "$log" | tail -n 1 | cut -d ' ' -f "$2"
}

# Until some frames in a row have changed nothing, however long they take.
settle() {
    waited=0
    until [ "$(tail -n 1 "$log")" = rest ]; do
        [ $waited -lt $((APP_TIMEOUT * 20)) ] || give_up "the window does not come to rest"
        kill -0 "$program" 2>/dev/null || give_up "the program has ended"
        sleep 0.05
        waited=$((waited + 1))
    done
}

# press NAME: a click on the middle of a part of the panel, which must be there. The program has heard of it when this returns; the mark
# is before it.
press() {
    settle
    place=$(grep -e "^widget $1 " "$log" | tail -n 1)
    [ -n "$place" ] || give_up "the panel has no $1"
    now
    # shellcheck disable=SC2046,SC2086
    xdotool mousemove --window "$window" $(middle_of $place) click 1
    expect "a click on $1" '^release 0$'
}

# middle_of widget NAME X0 Y0 X1 Y1
middle_of() {
    echo $((($3 + $5) / 2)) $((($4 + $6) / 2))
}

# open_list NAME WORD: until the word shows. A click that has opened nothing, as the window has come to rest, is done again: ImGui 1.86
# loses one that comes together with a change of what is under it.
open_list() {
    for try in 1 2 3 4 5 6; do
        press "$1"
        mark=$((mark + $(tail -n "+$((mark + 1))" "$log" | grep -n -m 1 '^release 0$' | cut -d : -f 1)))
        expect "anything of $1" "^widget $1/$2 \\|^rest\$"
        [ "$line" = rest ] || return 0
    done
    give_up "the list $1 does not open after $try clicks"
}

# choose NAME WORD KEY: opens a list and takes a word of it; the settings must then have KEY=WORD.
choose() {
    open_list "$1" "$2"
    press "$1/$2"
    expect "$1 $2" "^settings .*$3=$(printf '%s' "$2" | sed 's/[+]/[+]/') "
    expect "the list $1 to close" "^widget $1 "
}

# name_file NAME: types it into the panel.
name_file() {
    press file
    settle
    xdotool type --delay 50 "$1"
    expect "the file's name" "^settings .*file=$1\$"
}

# voxels EVENT: waits for it; `solid` and `hash` are those of the world after it.
voxels() {
    expect "$1" "^$1 solid "
    # shellcheck disable=SC2034
    solid=$(printf '%s' "$line" | cut -d ' ' -f 3)
    # shellcheck disable=SC2034
    hash=$(printf '%s' "$line" | cut -d ' ' -f 5)
}

# The window's picture must come to show something: picture NAME leaves it in $APP_PICTURES, where that is set.
picture() {
    waited=0
    until import -window "$window" "$work/$1.png" && [ "$(identify -format '%k' "$work/$1.png")" -gt 200 ]; do
        [ $waited -lt "$APP_TIMEOUT" ] || give_up "the window does not come to show a picture: $1"
        sleep 0.5
        waited=$((waited + 1))
    done
    [ -z "${APP_PICTURES:-}" ] || cp "$work/$1.png" "$APP_PICTURES/"
}

# wait_end: until the program has ended by itself; `status` is its exit status.
wait_end() {
    waited=0
    while kill -0 "$program" 2>/dev/null; do
        [ $waited -lt $((APP_TIMEOUT * 20)) ] || give_up "the program does not end"
        sleep 0.05
        waited=$((waited + 1))
    done
    wait "$program"
    status=$?
    program=""
    [ $status = 0 ] || bad "the program ended with $status: $(tail -n 5 "$work/said")"
    grep -q '^quit validation 0$' "$log" || bad "no clean end in the log: $(grep -m 3 validation "$work/said")"
}

# end_program: by Ctrl+Q; it must end well and have seen no validation message.
end_program() {
    now
    xdotool key ctrl+q
    wait_end
}

finish() {
    if [ "$failures" -gt 0 ]; then
        echo "$failures checks failed" >&2
        exit 1
    fi
    echo "all checks passed"
    exit 0
}
