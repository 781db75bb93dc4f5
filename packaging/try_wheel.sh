#!/usr/bin/env bash
# try_wheel.sh PYTHON WHEELS SOURCE: installs Ruedo's wheel by that Python from the folder WHEELS and nothing else, and tries it in
# the present directory: program, client, engine, the golden hashes, and the Python tests of the checkout SOURCE against what is
# installed (not with RUEDO_TESTS=none). packaging/try_in_debian.sh calls it in bare systems. Prints what happens; fails when something does not work.
set -eux
python=$1 wheels=$(realpath "$2") source=$(realpath "$3")

rm -rf venv other
"$python" -m venv venv
venv/bin/pip install -q --no-index --find-links "$wheels" 'ruedo[camera]'
venv/bin/ruedo --version
test -d "$(venv/bin/ruedo --prefix)/lib/cmake/ruedo" -a -s "$(venv/bin/ruedo --jar)"
venv/bin/ruedo check arena
venv/bin/ruedo render arena -o arena.png
venv/bin/ruedo run arena --rate max --duration 2 --seed 7 --record arena.lcm --lcm tcpq://127.0.0.1:7711
venv/bin/ruedo verify arena.lcm
venv/bin/python - <<'PYTHON'
import ruedo
with ruedo.launch("arena", rate="max", seed=3) as sim:
    robot = sim.robot("p3at")
    robot.advance(1.0).wait()
    assert abs(robot.pose.latest().x - 1.0) < 1e-3
try:
    ruedo.launch("nowhere")
except ruedo.LaunchError as error:
    assert "searched" in str(error)
PYTHON
# Ten minutes, as docs/getting-started.md has them, with the room that it draws without a browser.
venv/bin/python - "$source/docs/getting-started.md" <<'PYTHON'
import pathlib, re, sys
page = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
pathlib.Path("room.sh").write_text(re.search(r"^```sh test\n(cat > room.sdf.*?)^```", page, re.M | re.S)[1], encoding="utf-8")
for name, text in re.findall(r'^```python title="(\w+\.py)"\n(.*?)^```', page, re.M | re.S):
    pathlib.Path(name).write_text(text, encoding="utf-8")
PYTHON
PATH=$PWD/venv/bin:$PATH bash -eux room.sh
venv/bin/python drive.py
venv/bin/python -c 'import test_room; test_room.test_robot_advances_half_a_metre()'
# Beside another environment: each starts the server of its own.
"$python" -m venv other
other/bin/pip install -q --no-index --find-links "$wheels" 'ruedo[camera]'
for one in venv other; do
  [[ $($one/bin/ruedo --prefix) == "$PWD/$one/"* ]]
  $one/bin/python -c "import importlib; found = importlib.import_module('ruedo.launching').find_ruedo(); assert found.startswith('$PWD/$one/'), found"
done
rm -rf other

# ruedo.Engine wants Python 3.11 or newer.
engine=true
venv/bin/python -c 'import sys; sys.exit(sys.version_info < (3, 11))' || engine=false
if $engine; then
  runs=(arena fleet bases wheels arms meshes camera)
  [[ $(uname -m) != aarch64 ]] || runs=(arena fleet bases arms)    # pictures differ there: docs/platforms.md
  venv/bin/python "$source/tests/golden/wheel_runs.py" "${runs[@]}" | diff <(grep -E "^($(IFS='|' && echo "${runs[*]}")) " "$source/tests/golden/hashes.txt") -
else
  venv/bin/python -c 'import ruedo
try: ruedo.Engine("arena")
except ImportError as error: assert "3.11" in str(error), error'
fi

[[ ${RUEDO_TESTS-} != none ]] || exit 0
venv/bin/pip install -q --no-index --find-links "$wheels" 'ruedo[gym,logs,campaign,hunt,fit]' pytest
export RUEDO=$PWD/venv/bin/ruedo RUEDO_SOURCE_DIR=$source RUEDO_BUILD_DIR=/nowhere PYTHONDONTWRITEBYTECODE=1 PATH=$PWD/venv/bin:$PATH
# Left out: clients in other languages, LCM programs without Ruedo (LCM's wheel has no GLib), what wants a compiler, cmake, ip, libfaketime
# or user namespaces, and Ray.
left_out='cpp or java or bare or clock_that_jumps or interface_that_goes_down or full_disk or frozen_scan_and_the_find_is_kept'
failed=0
run_tests() {    # FOLDER NAME...
  (cd "$source/tests/$1" && python -m pytest -q -p no:cacheprovider -k "not ($left_out)" "${@:2}") || failed=1
}
run_tests clients {client,lockstep,unix,world,motion,networks,faults,launch,wander,hostile,hammer,vectors,python}_test.py
if $engine; then
  run_tests clients labs_test.py
  run_tests engine test_{engine,gym,randomize,policy}.py
  run_tests campaign test_{spec,run,controllers,faults,hunt}.py
  run_tests fit test_{readers,odometry,import,rangefinder,streams}.py
fi
exit $failed
