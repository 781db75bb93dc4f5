#!/usr/bin/env bash
# try_in_debian.sh FOLDER SUITE...: installs and tries Ruedo's wheel in a bare Debian of each suite (bookworm, trixie), made by debootstrap below
# FOLDER/SUITE: as an ordinary user, without compiler, network, GPU or display. FOLDER/wheels holds Ruedo's wheel and those of lcm and numpy
# for each suite's Python; with those of pytest, pandas, gymnasium, matplotlib and pyyaml, too, the tests of the Python client and engine run
# there (RUEDO_TESTS: which; all by default). Prints what happens; fails when something does not work, or the results of two suites differ.
# Wants root.
set -euo pipefail
folder=$(realpath "$1")
here=$(dirname "$(realpath "$0")")
shift

cat >"$folder/inside.sh" <<'INSIDE'
set -eux
ip link set lo up 2>/dev/null || true
cd ~
rm -rf venv
python3 -m venv venv
venv/bin/pip install -q --no-index --find-links /wheels ruedo
! command -v gcc
venv/bin/ruedo --version
test -d "$(venv/bin/ruedo --prefix)/lib/cmake/ruedo" -a -s "$(venv/bin/ruedo --jar)"
venv/bin/ruedo check arena
venv/bin/ruedo render arena -o arena.png
venv/bin/ruedo run arena --rate max --duration 2 --seed 7 --record arena.lcm --lcm tcpq://127.0.0.1:7711
venv/bin/ruedo verify arena.lcm
sha256sum arena.png >results
venv/bin/python - <<'PYTHON' >>results
import hashlib
import ruedo
with ruedo.launch("arena", rate="max", seed=3) as sim:
    robot = sim.robot("p3at")
    robot.advance(1.0).wait()
    assert abs(robot.pose.latest().x - 1.0) < 1e-3
try:
    ruedo.launch("nowhere")
except ruedo.LaunchError as error:
    assert "searched" in str(error)
for world in ("arena", "fleet", "office"):
    with ruedo.Engine(world, seed=7, record=True) as engine:
        digest = hashlib.sha256()
        for turn in range(10):
            engine.step([[[0.4, 0.3 * (turn % 3 - 1)]] * len(engine.robots)], 20)
            for one in engine.messages():
                digest.update(repr(one).encode())
        print(world, digest.hexdigest())
PYTHON
# Beside another environment: each starts the server of its own.
python3 -m venv other
other/bin/pip install -q --no-index --find-links /wheels ruedo
for one in venv other; do
  [[ $($one/bin/ruedo --prefix) == "$PWD/$one/"* ]]
  $one/bin/python -c "import importlib; found = importlib.import_module('ruedo.launch').find_ruedo(); assert found.startswith('$PWD/$one/'), found"
done
if compgen -G '/wheels/pytest-*' >/dev/null; then
  venv/bin/pip install -q --no-index --find-links /wheels pytest pandas gymnasium matplotlib pyyaml
  export RUEDO=$PWD/venv/bin/ruedo RUEDO_SOURCE_DIR=/src RUEDO_BUILD_DIR=/nowhere
  cd /src/tests
  tests=(clients/{client,lockstep,unix,world,motion,launch,hostile,python}_test.py engine)
  [[ -z $RUEDO_TESTS ]] || read -ra tests <<<"$RUEDO_TESTS"
  ~/venv/bin/python -m pytest -q -p no:cacheprovider "${tests[@]}"
fi
INSIDE

for suite in "$@"; do
  root=$folder/$suite
  if [[ ! -e $root/etc/debian_version ]]; then
    debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates "$suite" "$root" >"$folder/$suite.log"
  fi
  rm -rf "$root/wheels"
  cp -r "$folder/wheels" "$root/wheels"
  cp "$folder/inside.sh" "$root/inside.sh"
  rm -rf "$root/src"
  mkdir "$root/src"
  cp -r "$here/../tests" "$here/../worlds" "$here/../proto" "$here/../docs" "$root/src"
  chroot "$root" id user >/dev/null 2>&1 || chroot "$root" useradd --create-home user
  # A network of its own with nothing in it but the loopback interface; /proc for the program's way to its own files.
  unshare --net --mount bash -c 'ip link set lo up; ip route add 224.0.0.0/4 dev lo; mount -t proc proc "$0/proc"
    exec chroot --userspec=user:user "$0" env -i HOME=/home/user PATH=/usr/bin:/bin LANG=C.UTF-8 RUEDO_TESTS="${RUEDO_TESTS-}" bash /inside.sh' "$root"
  echo "$suite: all of it works"
  cp "$root/home/user/results" "$folder/$suite.results"
done
for suite in "$@"; do
  diff "$folder/$1.results" "$folder/$suite.results" || { echo "$suite: other bytes than $1's"; exit 1; }
done
echo "the same bytes in $*"
