#!/usr/bin/env bash
# exchange_logs.sh record RUEDO FOLDER: records half a second or less of some worlds by that program into FOLDER, which has arms.sdf and
# wheels.sdf of tests/golden. exchange_logs.sh verify RUEDO FOLDER: verifies such logs, of another machine. Without pictures they have to
# be the same, byte by byte; of pictures it is printed where they differ. scripts/on_arm64 runs one for aarch64.
set -euo pipefail
what=$1 ruedo=$2 folder=$3

record() {    # NAME WORLD SECONDS [OPTION...]
  "$ruedo" run "$2" --duration "$3" "${@:4}" --rate max --seed 7 --quiet --lcm memq:// --record "$folder/$1.lcm"
}

if [[ $what == record ]]; then
  record arena arena 0.5 --disable p3at/camera --spawn p3dx:guest@3.8,3.8,-2.4
  record fleet fleet 0.3 --disable alice/camera --disable bob/camera
  record arms "$folder/arms.sdf" 0.5
  record wheels "$folder/wheels.sdf" 0.5 --disable four/camera
  record meshes office 0.2 --disable p3at/camera
  record pictures arena 0.1
else
  for log in "$folder"/{arena,fleet,arms,wheels,meshes}.lcm; do "$ruedo" verify "$log"; done
  "$ruedo" verify "$folder/pictures.lcm" || (($? == 4))
fi
