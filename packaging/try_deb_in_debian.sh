#!/usr/bin/env bash
# try_deb_in_debian.sh FOLDER DEB SUITE: installs, tries and removes Ruedo's Debian package in a bare Debian of that suite, made by
# debootstrap in FOLDER/SUITE-ARCH. What runs, runs as an ordinary user, without GPU and display, and without a network but for apt's. Prints
# what happens; fails when something does not work, or something is left. Wants root. That for aarch64: by scripts/on_arm64 --root.
#
# First as the Containerfile has it, with nothing else there: server, camera, ROS 2, Python. Then with a compiler, CMake and a JDK: C++ and
# Java. Then it is purged.
# shellcheck disable=SC2016  # what is quoted is for the shells inside
set -euo pipefail
folder=$(realpath "$1") deb=$(realpath "$2") suite=$3
here=$(dirname "$(realpath "$0")")
arch=$(dpkg-deb -f "$deb" Architecture)
root=$folder/$suite-$arch

if [[ ! -e $root/etc/debian_version ]]; then
  debootstrap --arch "$arch" --variant=minbase --include=ca-certificates "$suite" "$root" >"$folder/$suite.log"
fi
# apt in there uses the same package sources as here.
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
rm -f "$root"/etc/apt/apt.conf.d/docker-*
trap 'umount "$root/proc" 2>/dev/null || true' EXIT
mount -t proc proc "$root/proc"
inside() { chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive bash -euxc "$1"; }
# As the user, in a network of its own with nothing in it but the loopback interface, over which multicast goes.
as_user() {
  unshare --net --mount bash -c 'ip link set lo up; ip route add 224.0.0.0/4 dev lo
    exec chroot --userspec=user:user "$0" env -i HOME=/home/user PATH=/usr/bin:/bin LANG=C.UTF-8 bash -euxc "cd; $1"' "$root" "$1"
}
inside 'id user 2>/dev/null || useradd --create-home user; apt-get -q update >/dev/null'

# The steps of the Containerfile: what it copies, and what it runs.
mkdir -p "$root/tmp/ruedo"
cp "$deb" "$root/tmp/ruedo/"
sed -n 's/^RUN //p' "$here/../Containerfile" | while read -r step; do inside "$step" >"$folder/$suite.apt.log" 2>&1 || { cat "$folder/$suite.apt.log"; exit 1; }; done
inside 'dpkg -L ruedo' 2>/dev/null >"$folder/$suite.files"

as_user '! command -v gcc; ! command -v java
ruedo --version
ruedo check arena
ruedo run arena --rate max --duration 2 --seed 7 --record arena.lcm
ruedo verify arena.lcm
ruedo render arena -o arena.png; ruedo render arena --camera p3at/camera -o camera.png
ruedo run arena --rate max --duration 2 --ros2 --quiet
cat > first.py <<PYTHON
import ruedo
with ruedo.launch("arena", rate="max", seed=3) as sim:
    robot = sim.robot("p3at")
    robot.advance(1.0).wait()
    assert abs(robot.pose.latest().x - 1.0) < 1e-3
    assert robot.camera.next(60).data[:2] == b"\xff\xd8"
with ruedo.Engine("arena", seed=7) as engine:
    engine.step([0.4, 0.0], 20)
print("python:", ruedo.__file__)
PYTHON
python3 first.py
zcat /usr/share/man/man1/ruedo-run.1.gz | grep -q "serve a world"
source /usr/share/bash-completion/completions/ruedo
COMP_WORDS=(ruedo ver) COMP_CWORD=1; _ruedo; test "${COMPREPLY[*]}" = verify
COMP_WORDS=(ruedo run --rec) COMP_CWORD=2; _ruedo; test "${COMPREPLY[*]}" = "--record --record-limit"'

inside 'apt-get -q update >/dev/null; apt-get -q install --no-install-recommends -y g++ make cmake pkg-config default-jdk-headless' >"$folder/$suite.apt.log" 2>&1 ||
  { cat "$folder/$suite.apt.log"; exit 1; }
as_user 'rm -rf cpp && mkdir cpp && cd cpp
cat > drive.cpp <<CPP
#include <cstdio>
#include <ruedo/client.h>
int main() {
  auto sim = ruedo::client::launch("arena");
  auto robot = sim.robot("p3at");
  robot.advance(0.5).wait();
  std::printf("c++: %.3f\n", robot.pose().latest().x());
}
CPP
g++ -std=c++17 drive.cpp -o by-pkg-config $(pkg-config --cflags --libs ruedo)
./by-pkg-config
printf "cmake_minimum_required(VERSION 3.25)\nproject(drive CXX)\nfind_package(ruedo REQUIRED)\nadd_executable(drive drive.cpp)\ntarget_link_libraries(drive PRIVATE ruedo::client)\n" > CMakeLists.txt
cmake -B build .
cmake --build build
build/drive
cat > Drive.java <<JAVA
import ruedo.*;
public class Drive {
  public static void main(String[] arguments) {
    try (Simulation sim = Ruedo.launch("arena")) {
      Robot robot = sim.robot("p3at");
      robot.advance(0.5).await(30);
      System.out.printf("java: %.3f%n", robot.pose().latest().x());
    }
  }
}
JAVA
java -cp "$(ruedo --jar)" Drive.java'

# Python as root leaves its caches among the files; still nothing may be left.
inside 'python3 -c "import ruedo" && dpkg -P ruedo'
left=0
while read -r file; do
  if [[ -e $root$file && ( ! -d $root$file || $file == */ruedo ) ]]; then echo "left: $file"; left=1; fi
done <"$folder/$suite.files"
find "$root/usr" "$root/etc" "$root/var" -iname '*ruedo*' -not -path '*/tmp/*' | grep . && left=1
((left == 0)) || { echo "$suite: something is left"; exit 1; }
echo "$suite: installed, tried, removed without a rest"
