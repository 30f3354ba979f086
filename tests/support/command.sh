# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=sh
# For tests of the command as its user meets it. Expects $hyst and $folder; makes the folder anew and goes there.

rm -rf "$folder" && mkdir -p "$folder" && cd "$folder" || exit 1
failures=0
case='' # named in a complaint
: >stdout
: >stderr

complain() {
    echo "FAIL: ${case:+$case: }$*"
    sed 's/^/    /' stdout stderr
    failures=$((failures + 1))
}

# expect STATUS TEXT ARGUMENT...   status, and in the file stderr nothing (TEXT empty) or exactly one line that contains
#                                  TEXT; what was printed is in the file stdout
expect() {
    status=$1
    text=$2
    got=0
    shift 2
    "$hyst" "$@" >stdout 2>stderr || got=$?
    [ "$got" -eq "$status" ] || complain "hyst $*: exit status $got, expected $status"
    if [ -z "$text" ]; then
        [ ! -s stderr ] || complain "hyst $*: unexpected message"
    else
        [ "$(wc -l <stderr)" -eq 1 ] || complain "hyst $*: stderr is not one line"
        grep -qF -- "$text" stderr || complain "hyst $*: no '$text' in the message"
    fi
}

# has FILE TEXT
has() {
    grep -qF -- "$2" "$1" || complain "no '$2' in $1"
}

finish() {
    echo "$failures failures"
    [ "$failures" -eq 0 ] || exit 1
}
