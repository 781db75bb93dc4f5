#!/usr/bin/env bash
# man_pages.sh RUEDO FOLDER: ruedo.1 and a page for each command in FOLDER, compressed, from the program's --help.
set -euo pipefail
ruedo=$1 folder=$2
mkdir -p "$folder"
page() {    # NAME WHAT COMMAND...
  local name=$1 what=$2
  shift 2
  SOURCE_DATE_EPOCH=0 LC_ALL=C help2man --no-info --section=1 --name="$what" --version-string="$("$ruedo" --version)" "$*" |
    sed "s/^\.TH .*/.TH ${name^^} 1 \"\" \"$("$ruedo" --version)\" \"User Commands\"/" | gzip -9n >"$folder/$name.1.gz"
}
page ruedo "a simulation server for mobile robots" "$ruedo"
# The program that ruedo starts.
cat <<PAGE | gzip -9n >"$folder/ruedo-import-mesh.1.gz"
.TH RUEDO-IMPORT-MESH 1 "" "$("$ruedo" --version)" "User Commands"
.SH NAME
ruedo-import-mesh \- reads one mesh file for ruedo
.SH DESCRIPTION
ruedo starts this program to read the meshes of worlds and robots, within limits of time and memory and apart from other files. It is
not for other uses.
.SH SEE ALSO
.BR ruedo (1)
PAGE
"$ruedo" --help | sed -n '/^Subcommands:/,/^[A-Z][a-z]* codes/s/^  \([a-z0-9-]\+\) \+\(.*\)/\1 \2/p' | while read -r command what; do
  "$ruedo" "$command" --help >/dev/null 2>&1 </dev/null || continue    # a command of the Python client, which is not there
  page "ruedo-$command" "$what" "$ruedo" "$command" </dev/null
done
