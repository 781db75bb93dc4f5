#!/bin/sh
# Gets Debian 12's LCM 1.3.1 into a folder, without installing it: old clients must work against the server.
# Where that cannot be had (another Debian, no network), nothing is left behind, and the test that wants it is skipped.
set -eu
folder=$1
[ -d "$folder/usr" ] && exit 0
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
if ! apt-get download liblcm1=1.3.1* liblcm-dev=1.3.1* >/dev/null 2>&1; then
  echo "LCM 1.3.1 cannot be had from this machine's package sources"
  exit 0
fi
for package in *.deb; do dpkg-deb -x "$package" root; done
mkdir -p "$(dirname "$folder")"
mv root "$folder"
