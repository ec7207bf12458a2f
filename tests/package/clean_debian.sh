#!/usr/bin/env bash
# Installs the packages in a minimal Debian and runs the first steps of a new user there: bake, sense, serve, send,
# evaluate, read a manual page, compile the examples with the command in their first comment. Takes minutes and needs the
# network: only with LBEA_LONG_TESTS=1.
#   clean_debian.sh PACKAGES_DIR
set -euo pipefail
packages=$1
project=$(cd "$(dirname "$0")/../.." && pwd)
skip() { echo "skipped: $*"; exit 77; }
[ "${LBEA_LONG_TESTS:-0}" = 1 ] || skip "a long test; set LBEA_LONG_TESTS=1 or use tests/run.sh --long"
[ "$(id -u)" -eq 0 ] || skip "debootstrap needs root"
command -v debootstrap >/dev/null || skip "debootstrap is not installed"
mirror=${LBEA_DEBIAN_MIRROR:-http://deb.debian.org/debian}

root=$(mktemp -d)
chmod 755 "$root"
clean_up() {
  umount "$root/proc" 2>/dev/null || true
  mountpoint -q "$root/proc" || rm -rf --one-file-system "$root"
}
trap clean_up EXIT
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" 2>&1 ||
  { tail -n 5 "$root.log"; rm -f "$root.log"; skip "debootstrap could not build a Debian here from $mirror"; }
rm -f "$root.log"
mount -t proc proc "$root/proc" || skip "proc cannot be mounted here"
printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
chmod +x "$root/usr/sbin/policy-rc.d"

mkdir -p "$root/packages" "$root/home/user"
cp "$packages"/*.deb "$root/packages"
cp -r "$project/tests/data/rail-demo" "$project/docs/examples" "$root/home/user"
cp "$project/tests/package/first_steps.sh" "$root/home/user"
env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/home/user LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
  chroot "$root" bash -c 'cd /home/user && bash first_steps.sh /packages'
