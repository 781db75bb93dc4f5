#!/usr/bin/env bash
# try_in_debian.sh FOLDER WHEELS SUITE...: installs and tries Ruedo's wheels, in the folder WHEELS, in a bare Debian of each suite (bookworm, trixie), made by
# debootstrap in FOLDER/SUITE-ARCH: as an ordinary user, without compiler, GPU or display, and without a network: what the wheel depends on is
# fetched by pip before. packaging/try_wheel.sh says what is tried. Prints what happens; fails when something does not
# work. Wants root. RUEDO_ARCH=arm64 scripts/on_arm64 --root packaging/try_in_debian.sh ... tries those for aarch64.
# shellcheck disable=SC2016  # what is quoted is for the shells inside
set -euo pipefail
here=$(dirname "$(realpath "$0")")
mkdir -p "$1"
folder=$(realpath "$1") wheels=$(realpath "$2")
arch=${RUEDO_ARCH:-$(dpkg --print-architecture)} machine=$(uname -m)
[[ $arch != arm64 ]] || machine=aarch64
shift 2

# The wheels that the given Python (3.13) takes, into a folder.
fetch_wheels() {
  local version=$1 to=$2 platforms=() glibc
  for glibc in {36..5}; do platforms+=(--platform "manylinux_2_${glibc}_$machine"); done
  local what=(pytest "ruedo[camera,gym,logs,campaign,hunt,fit]")
  [[ ${RUEDO_TESTS-} != none ]] || what=("ruedo[camera]")
  mkdir -p "$to"
  rm -f "$to"/ruedo[-_]*
  python3 -m pip download -q --find-links "$wheels" --dest "$to" --only-binary=:all: --python-version "$version" "${platforms[@]}" \
    --platform "manylinux2014_$machine" --platform "manylinux2010_$machine" "${what[@]}"
}

for suite in "$@"; do
  root=$folder/$suite-$arch
  if [[ ! -e $root/etc/debian_version ]]; then
    script=/usr/share/debootstrap/scripts/$suite
    [[ -e $script ]] || script=/usr/share/debootstrap/scripts/sid
    debootstrap --arch "$arch" --variant=minbase --include=python3,python3-venv "$suite" "$root" http://deb.debian.org/debian "$script" >"$folder/$suite.log" ||
      { tail "$folder/$suite.log"; exit 1; }
  fi
  version=$(chroot "$root" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  fetch_wheels "$version" "$folder/wheels-$version-$arch"
  rm -rf "$root/wheels" "$root/src"
  cp -r "$folder/wheels-$version-$arch" "$root/wheels"
  mkdir -p "$root/src/clients/python"
  cp -r "$here" "$here/../tests" "$here/../worlds" "$here/../proto" "$here/../docs" "$root/src"
  cp -r "$here/../clients/python/examples" "$root/src/clients/python"
  chroot "$root" id user >/dev/null 2>&1 || chroot "$root" useradd --create-home user
  # A network of its own with nothing in it but the loopback interface; /proc, /dev/shm and /dev/pts as every running system has them.
  unshare --net --mount --pid --fork bash -c 'ip link set lo up; ip route add 224.0.0.0/4 dev lo; mount -t proc proc "$0/proc"
    mount -t tmpfs tmpfs "$0/dev/shm"; mount -t devpts -o newinstance,ptmxmode=0666 devpts "$0/dev/pts"; mount --bind "$0/dev/pts/ptmx" "$0/dev/ptmx"
    exec chroot --userspec=user:user "$0" env -i HOME=/home/user PATH=/usr/bin:/bin LANG=C.UTF-8 RUEDO_TESTS="${RUEDO_TESTS-}" \
      bash -c "cd; ! command -v gcc && bash /src/packaging/try_wheel.sh python3 /wheels /src"' "$root"
  echo "$suite, $arch: all of it works, with Python $version"
done
