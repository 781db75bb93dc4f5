#!/usr/bin/env bash
# release_in_debian.sh FOLDER SUITE OUT [--deb]: runs scripts/release for the checkout's commit in a bare Debian of that suite, made
# by debootstrap in FOLDER/SUITE, and puts what it makes into OUT. The bytes are those of a release on any other host with that
# Debian's packages. apt, pip and npm use the same package sources as here. Wants root.
set -euo pipefail
folder=$(realpath "$1") suite=$2 out=$(realpath "$3")
shift 3
here=$(dirname "$(realpath "$0")")
root=$folder/$suite

if [[ ! -e $root/etc/debian_version ]]; then
  debootstrap --variant=minbase --include=ca-certificates,git "$suite" "$root" >"$folder/$suite.log"
fi
# debootstrap leaves out the updates of security, without which old libraries would go into the wheels.
mirror=$(sed -n 's/^deb \(\[.*\] \)\?\([^ ]*\) .*/\2/p;q' "$root/etc/apt/sources.list")
printf 'deb %s %s main\n' "$mirror" "$suite" "$mirror" "$suite-updates" "${mirror%/}-security" "$suite-security" >"$root/etc/apt/sources.list"
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
rm -f "$root"/etc/apt/apt.conf.d/docker-*
echo 'DPkg::Options:: "--force-confold";' >"$root/etc/apt/apt.conf.d/90keep"    # packages bring some of these files
for config in /etc/pip.conf "$HOME/.npmrc" /etc/ssl/certs/ca-certificates.crt; do    # a proxy may sign for the registries
  [[ ! -e $config ]] || install -D "$config" "$root${config/#$HOME/\/root}"
done
trap 'umount "$root/proc" 2>/dev/null || true' EXIT
mount -t proc proc "$root/proc"
rm -rf "$root/ruedo" "$root/out"
git clone --quiet --no-hardlinks "$here/.." "$root/ruedo"
chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive bash -euc \
  'apt-get -q update >/dev/null; apt-get -q -y dist-upgrade >/dev/null; /ruedo/scripts/release "$@" /out' bash "$@"
mkdir -p "$out"
cp "$root"/out/* "$out"
