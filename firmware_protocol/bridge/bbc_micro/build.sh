#!/bin/sh
# Builds BRIDGE (19200 baud), BRIDG96 (9600 baud) and a disc image with both into the folder given (default: here), with
# ca65 and ld65 of Debian's package cc65, and python3. Both are loaded to 1900 and started there.
set -e
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here}
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
build() { # name, option
    objects=
    for file in start variables line crc frames requests session memory stop units samples period; do
        ca65 ${2:+$2} -I "$here" -o "$work/$file.o" "$here/$file.s"
        objects="$objects $work/$file.o"
    done
    ld65 -C "$here/bridge.cfg" -Ln "$out/$1.labels" -m "$out/$1.map" -o "$out/$1" $objects
}
build BRIDGE ""
build BRIDG96 "-DULA_RATE=100"
python3 "$here/disc_image.py" "$out"
