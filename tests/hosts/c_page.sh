#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The programs of the manual's page on C are compiled and run: c_page.sh SOURCE LIBRARY. The one in C prints what the page
# shows; the one in Fortran, if there is a compiler, computes exp(-1).
set -euo pipefail
page=$1/dsl-examples/manual/c.md library=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
block() { awk -v fence="^\`\`\`$1\$" '$0 ~ fence { on = 1; next } /^```/ { if (on) exit } on' "$page"; }

block c > "$folder/rod.c"
block text > "$folder/shown"
"${CC:-cc}" -std=c99 -Wall -Wextra -Werror -I "$1/compiler/include" "$folder/rod.c" -o "$folder/rod" "$library" \
            -Wl,-rpath,"$(dirname "$2")" -lm
"$folder/rod" | diff - "$folder/shown"

command -v gfortran >/dev/null || { echo "no gfortran: the program in Fortran is not tested"; exit 0; }
block fortran > "$folder/rod.f90"
gfortran -std=f2008 "$folder/rod.f90" -o "$folder/decay" "$library" -Wl,-rpath,"$(dirname "$2")"
"$folder/decay" | awk '{ if (($1 - $2)^2 > 1e-4) { print "exp(-1) by Fortran is", $1; exit 1 } }'
