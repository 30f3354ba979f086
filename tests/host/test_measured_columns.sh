#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# hyst diagnose on recordings with measured voltage, current and temperature, as its user meets it. The recordings come
# from an actuator that shares no formula with the tool. Usage: test_measured_columns.sh HYST WRITER FOLDER (made anew)
set -u
hyst=$1
writer=$2
folder=$3
rm -rf "$folder" && mkdir -p "$folder" && cd "$folder" || exit 1
failures=0

complain() {
    echo "FAIL: $*"
    sed 's/^/    /' words
    failures=$((failures + 1))
}

# diagnose CASE   words: what it prints, on one line; f.json, f.html
diagnose() {
    name=$1
    "$writer" "$name" "$name.csv" >seed || complain "$name: not written"
    "$hyst" diagnose "$name.csv" --json f.json --report f.html >printed 2>stderr || complain "$name: $(cat stderr)"
    tr -s '\n ' ' ' <printed >words
    tr -s '\n ' ' ' <f.json >json
}

# says TEXT   on the terminal;   has TEXT   in JSON
says() {
    grep -qF -- "$1" words || complain "$name: does not say '$1'"
}
has() {
    grep -qF -- "$1" json || complain "$name: no '$1' in JSON"
}

diagnose amplifier_alone # and without a column there is no word of them
if grep -q '^measured\|^   beside' printed || grep -q '"measured[a-z_]*":' f.json || grep -q 'else was measured\|Measured beside' f.html; then
    complain "$name: a word of columns that there are not"
fi

diagnose nothing
has '"verdict": "nothing missing"'
says 'does not go with the temperature'
says 'does not go with the measured voltage'
says 'of the current; '
[ "$(grep -o '"relation": "none"' json | wc -l)" -eq 6 ] || complain "$name: a relation"
grep -q 'What else was measured' f.html || complain "$name: not on the page"

# The same lag of the position, before the voltage and behind it.
diagnose amplifier_voltage
has '"block": "amplifier_bandwidth"'
has '"certainty": "named"'
has '"verdict": "present"'
has '"verdict": "explained"'
says 'The measured voltage shows it'
says 'With what was found, nothing of that remains.'
grep -q 'Measured beside it' f.html || complain "$name: not on the page"
diagnose amplifier_current
has '"block": "amplifier_bandwidth"'
says 'The measured current shows it'
diagnose sensor_voltage
has '"block": "sensor_bandwidth"'
has '"verdict": "absent"'
has '"verdict": "explained"'
says 'it is behind the amplifier'
diagnose delay_before
has '"block": "transport_delay"'
says 'it is in the amplifier'
diagnose delay_behind # the chain is the same
has '"block": "transport_delay"'
has '"certainty": "named"'
says 'it is behind the amplifier'

# Two lags: each on its side, and within 3 % of 300 and 500 Hz. (The position alone makes one of 190 Hz of them.)
near() {
    awk -v name="$1" -v truth="$2" '
        index($0, "\"block\": \"" name "\"") { here = 1 }
        here && /"value":/ { sub(/.*: /, ""); exit !($0 > 0.97 * truth && $0 < 1.03 * truth) }' findings ||
        complain "$name: $1 is not $2"
}
diagnose low_passes
sed -n '/"findings"/,/"not_found"/p' f.json >findings
near amplifier_bandwidth 300
near sensor_bandwidth 500
has '"verdict": "explained"'
diagnose delay_and_sensor
sed -n '/"findings"/,/"not_found"/p' f.json >findings
near transport_delay 0.0005
near sensor_bandwidth 300

diagnose slew_current
has '"block": "amplifier_slew_limit"'
says 'The measured current shows it'

# No block has a thermometer.
diagnose cycling
has '"verdict": "unknown physics"'
has '"relation": "goes with it"'
says 'What the model leaves goes with the temperature: 0.0'
diagnose warming
has '"relation": "looks like it"'
says 'cannot be told from any other slow drift'
diagnose wandering
has '"relation": "goes with it"'
has '"findings": []' # a block that moves slowly explains a part, but stands for nothing beside the thermometer
says 'But it goes with the temperature.'

[ "$failures" -eq 0 ] || exit 1
