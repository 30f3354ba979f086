#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Files that the hyst command writes: never over an input, whole or not at all, and tried before the work begins.
# Usage: test_outputs.sh HYST FOLDER (made anew)
set -u
hyst=$1
folder=$2
# shellcheck source-path=SCRIPTDIR source=../support/command.sh
. "$(dirname "$0")/../support/command.sh"

# write_recording SAMPLES: a play operator of 20 V under triangles, and a little noise from a fixed sequence.
write_recording() {
    awk -v samples="$1" 'BEGIN {
        print "# sample_rate_hz: 1000\n# drive_unit: V\n# displacement_unit: um\nt,drive,displacement,reference"
        n = split("0 100 -100 60 -20 100 -100 100 20 100 -100 50 0 100 -100 100", corner, " ")
        z = 0; noise = 1
        for (k = 0; k < samples; k++) {
            line = int(k / 100); a = corner[line % n + 1]; b = corner[(line + 1) % n + 1]
            u = a + (b - a) * (k % 100) / 100
            if (z < u - 20) z = u - 20
            if (z > u + 20) z = u + 20
            noise = (noise * 16807) % 2147483647
            x = 5 + 0.1 * u + 0.05 * z
            printf "%.3f,%.4f,%.6f,%.6f\n", k / 1000, u, x + 0.02 * (noise / 2147483647 - 0.5), x
        }
    }'
}
write_recording 3000 >good.csv
expect 0 '' fit good.csv --operators 3 -o model.json
mkdir originals
cp good.csv model.json originals

# kept FILE: it is what it was, and nothing was left beside it.
kept() {
    cmp "$1" "originals/$1" || complain "$1 was changed"
    if [ -n "$(find . -name '.hyst-*')" ]; then complain "$(find . -name '.hyst-*') was left behind"; fi
}

# A name that promises another format: what is written would be no such file.
case='format by name'
for name in out.mat OUT.NPZ out.csv.gz out.xlsx; do
    expect 1 "$name: hyst writes no such files" import good.csv -o "$name"
    expect 1 "$name: hyst writes no such files" fit good.csv -o "$name"
    if [ -e "$name" ]; then complain "$name was written"; fi
done
expect 0 '' import good.csv -o mat
rm mat

# An output that is an input, by name, through a symbolic link and through a hard link, in every command that writes.
for other in same symbolic hard; do
    rm -f other.csv other.json
    case $other in
    same) csv=./good.csv json=./model.json ;;
    symbolic) csv=other.csv json=other.json && ln -s good.csv other.csv && ln -s model.json other.json ;;
    hard) csv=other.csv json=other.json && ln good.csv other.csv && ln model.json other.json ;;
    esac
    case="$other file"
    expect 1 "$csv: is the same file as the input good.csv" fit good.csv -o "$csv"
    expect 1 "$csv: is the same file as the input good.csv" fit good.csv --family all -o "$csv"
    expect 1 "$csv: is the same file as the input good.csv" simulate model.json good.csv -o "$csv"
    expect 1 "$json: is the same file as the input model.json" simulate model.json good.csv -o "$json"
    expect 1 "$json: is the same file as the input model.json" compile model.json -o "$json"
    expect 1 "$csv: is the same file as the input good.csv" diagnose good.csv -o "$csv"
    expect 1 "$csv: is the same file as the input good.csv" diagnose good.csv "--json=$csv"
    expect 1 "$csv: is the same file as the input good.csv" diagnose good.csv --report "$csv"
    expect 1 "$json: is the same file as the input model.json" diagnose good.csv --model model.json -o "$json"
    expect 1 "$json: is the same file as the input model.json" report model.json good.csv a=good.csv,good.csv -o "$json"
    expect 1 "$csv: is the same file as the input good.csv" report model.json nowhere.csv a=nowhere.csv,good.csv -o "$csv"
    expect 1 "$csv: is the same file as the input good.csv" report model.json nowhere.csv a=good.csv,nowhere.csv --picture "$csv"
    expect 1 "$json: is the same file as the input model.json" twin model.json --converter nowhere/none --log "$json"
    expect 1 "$json: is the same file as the input model.json" bench --image none --model model.json --log "$json"
    kept good.csv
    kept model.json
done
case=''
expect 1 'two: is the same file as the output two' diagnose good.csv -o two --json=two
expect 1 './two: is the same file as the output two' diagnose good.csv -o two --report ./two

# Every output is tried before the work begins: here before an input that is missing is even looked for, and before a
# port is opened.
mkdir directory
: >protected.csv
chmod 444 protected.csv
ln -s nothing dangling
for path in nowhere/x directory good.csv/x dangling; do
    expect 1 "$path: " fit missing.csv -o "$path"
    expect 1 "$path: " simulate model.json missing.csv -o "$path"
    expect 1 "$path: " compile missing.json -o "$path"
    expect 1 "$path: " diagnose missing.csv -o "$path"
    expect 1 "$path: " diagnose missing.csv "--json=$path"
    expect 1 "$path: " diagnose missing.csv --report "$path"
    expect 1 "$path: " report missing.json missing.csv a=b,c -o "$path"
    expect 1 "$path: " report missing.json missing.csv a=b,c --picture "$path"
    expect 1 "$path: " record --port none --waveform sine -o "$path"
    expect 1 "$path: " track --port none --waveform sine --mode linear -o "$path"
    expect 1 "$path: " pull --port none -o "$path"
    expect 1 "$path" watch --port none --model model.json --report "$path"
    expect 1 "$path: " twin missing.json --converter nowhere/none --log "$path"
    expect 1 "$path: " bench --image none --model missing.json --log "$path"
done
if [ "$(id -u)" -ne 0 ]; then # nothing is read only for root
    expect 1 'protected.csv: Permission denied' fit good.csv -o protected.csv
fi
mkdir track-linear.csv
expect 1 'track-linear.csv: Is a directory' track --port none --waveform sine --both -o track.csv
expect 1 'cannot open none' track --port none --waveform sine --both -o trace.csv

# A link stays a link, and permissions stay. Pipes and devices are written in place.
cp good.csv target.csv
chmod 640 target.csv
ln -s target.csv link.csv
expect 0 '' simulate model.json good.csv -o link.csv
[ -L link.csv ] || complain 'the link was replaced by a file'
[ "$(stat -c %a target.csv)" = 640 ] || complain 'the permissions were changed'
expect 0 '' simulate model.json target.csv # whole: a recording, and the model's own
has stdout 'NRMSE 0.0000 %'
expect 0 '' simulate model.json good.csv -o /dev/null
[ -c /dev/null ] || complain '/dev/null is a file now'
expect 0 '' fit good.csv --operators 3 --json -o /dev/stdout
has stdout 'hyst-model-1'
mkfifo pipe
cat pipe >through &
expect 0 '' simulate model.json good.csv -o pipe
wait
cmp through target.csv || complain 'what went through the pipe is another recording'

# out_of_room BLOCKS COMMAND...: the command fails to write the file `old` (any form), which stays what it was: once
# where no file may grow beyond this many blocks, once in a file system that is full.
out_of_room() {
    blocks=$1
    shift
    for limit in file filesystem; do
        case="no room in a $limit"
        case $limit in
        file) place=. ;;
        filesystem) mount -t tmpfs -o size=8k none small 2>/dev/null || continue && place=small ;;
        esac
        echo 'what was here before' >"$place/old"
        if [ "$limit" = file ]; then
            { (ulimit -f "$blocks" && exec "$hyst" "$@" "$place/old" >/dev/null) || echo $? >status; } 2>&1 | cat >stderr
        else
            head -c 3k /dev/zero >small/filler
            { "$hyst" "$@" "$place/old" >/dev/null || echo $? >status; } 2>stderr
        fi
        [ "$(cat status)" = 1 ] || complain "$*: exit status $(cat status)"
        echo 0 >status
        [ "$(wc -l <stderr)" -eq 1 ] || complain "$*: stderr is not one line"
        grep -q "$place/old: .*\(File too large\|No space left on device\)" stderr || complain "$*: another message"
        [ "$(cat "$place/old")" = 'what was here before' ] || complain "$*: the old file is gone"
        if [ -n "$(find "$place" -name '.hyst-*')" ]; then complain "$*: a part was left behind"; fi
        if [ "$limit" = filesystem ]; then umount small; fi
    done
    case=''
}
mkdir small
expect 0 '' fit good.csv --operators 200 -o large.json
out_of_room 2 simulate model.json good.csv -o
out_of_room 2 fit good.csv --operators 200 -o
out_of_room 0 compile large.json -o
out_of_room 2 report model.json good.csv a=good.csv,good.csv -o
out_of_room 0 report model.json good.csv a=good.csv,good.csv --picture
out_of_room 2 diagnose good.csv --report

# A kill at any time leaves the old file or the whole new one. Writing 200000 samples takes a good part of a second, so
# some of these land in it.
write_recording 200000 >long.csv
expect 0 '' simulate model.json long.csv -o whole.csv
for tenths in 2 4 6 8 10 12 14 16; do
    echo 'what was here before' >old.csv
    timeout -s KILL "$((tenths / 10)).$((tenths % 10))" "$hyst" simulate model.json long.csv -o old.csv >/dev/null
    [ "$(cat old.csv)" = 'what was here before' ] || cmp old.csv whole.csv || complain "killed after 0.$tenths s: neither old nor new"
done

finish
