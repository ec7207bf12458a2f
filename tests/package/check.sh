#!/usr/bin/env bash
# Builds the Debian packages from a build folder and checks their content.
#   check.sh BUILD_DIR PACKAGES_DIR
set -euo pipefail
build=$1 packages=$2
fail() { printf '%s\n' "$*" >&2; exit 1; }

rm -rf "$packages"
mkdir -p "$packages"
(cd "$build" && cpack -G DEB -B "$packages") >"$packages/cpack.log" 2>&1 || { cat "$packages/cpack.log"; fail "cpack failed"; }
rm -rf "$packages/_CPack_Packages"

package() { find "$packages" -name "$1_*.deb"; }
field() { dpkg-deb -f "$(package "$1")" "$2"; }
contents() { dpkg-deb --fsys-tarfile "$(package "$1")" | tar -t; }
holds() { # package, pattern...
  local name=$1 list
  shift
  list=$(contents "$name")
  for pattern in "$@"; do grep -qE "$pattern" <<<"$list" || fail "$name contains no $pattern:" "$list"; done
}

for name in liblbea0 liblbea-wire0 liblbea-dev lbea-tools; do
  [ -n "$(package $name)" ] || fail "no package $name was made"
  holds $name "^./usr/share/doc/$name/copyright$"
  [ "$(field $name Description | wc -l)" -ge 3 ] || fail "$name has no description"
  dpkg-deb --fsys-tarfile "$(package $name)" | tar -tv | awk '$2 != "root/root" {exit 1}' || fail "$name: files are not owned by root"
  contents $name | grep -vE '^\./(usr/(bin|include|lib|share)(/|$)|usr/$|$)' && fail "$name has files in other folders"
done
# Not by a pipe: grep would end before tar, which then fails by SIGPIPE.
copyright=$(dpkg-deb --fsys-tarfile "$(package liblbea0)" | tar -xO ./usr/share/doc/liblbea0/copyright)
grep -q "The owners have not chosen a license" <<<"$copyright" ||
  fail "the copyright file of liblbea0 does not say that no license is chosen"

holds liblbea0 '/liblbea\.so\.0$' '/liblbea\.so\.0\.[0-9.]+$'
contents liblbea0 | grep -E '/include/|/bin/|\.a$|\.so$' && fail "liblbea0 contains more than the library"
needs=$(field liblbea0 Depends | tr ',' '\n' | sed 's/ *\([^ ]*\).*/\1/' | LC_ALL=C sort | tr '\n' ' ')
[ "$needs" = "libc6 libgcc-s1 libstdc++6 " ] || fail "liblbea0 depends on $needs"
dpkg-deb -I "$(package liblbea0)" shlibs | grep -q '^liblbea 0 liblbea0' || fail "liblbea0 has no shlibs file, which dependent packages need"

holds liblbea-wire0 '/liblbea-wire\.so\.0$' '/liblbea-wire\.so\.0\.[0-9.]+$'
contents liblbea-wire0 | grep -E '/include/|/bin/|\.a$|\.so$' && fail "liblbea-wire0 contains more than the library"
needs=$(field liblbea-wire0 Depends | tr ',' '\n' | sed 's/ *\([^ ]*\).*/\1/' | LC_ALL=C sort | tr '\n' ' ')
[ "$needs" = "libc6 libgcc-s1 libsodium23 libstdc++6 " ] || fail "liblbea-wire0 depends on $needs"
dpkg-deb -I "$(package liblbea-wire0)" shlibs | grep -q '^liblbea-wire 0 liblbea-wire0' || fail "liblbea-wire0 has no shlibs file"

version=$(field liblbea0 Version)
holds liblbea-dev '/include/lbea/lbea\.h$' '/include/lbea/lbea\.hpp$' '/include/lbea/wire/client\.hpp$' '/include/lbea/rig/sensor_json\.hpp$' '/liblbea\.so$' '/liblbea\.a$' \
  '/liblbea_wire\.a$' '/include/lbea/wire\.h$' '/liblbea-wire\.so$' '/lbea-config\.cmake$' '/pkgconfig/lbea\.pc$' '/pkgconfig/lbea-wire-c\.pc$' '/pkgconfig/lbea-wire\.pc$' '/pkgconfig/lbea-rig\.pc$' '/schema/frame\.fbs$'
for name in liblbea0 liblbea-wire0; do
  field liblbea-dev Depends | grep -qF "$name (= $version)" || fail "liblbea-dev does not depend on its own $name"
done

for program in bake serve send inspect eval; do holds lbea-tools "/usr/bin/lbea-$program$"; done
field lbea-tools Depends | grep -q libsodium || fail "lbea-tools does not depend on libsodium"
field lbea-tools Depends | grep -q libzmq && fail "lbea-tools uses the system's libzmq"
if command -v help2man >/dev/null; then
  for program in $(contents lbea-tools | sed -n 's|^./usr/bin/\(lbea-[a-z]*\)$|\1|p'); do holds lbea-tools "/man1/$program\.1\.gz$"; done
else
  echo "manual pages not checked: help2man is not installed"
fi
if [ -n "$(package python3-lbea)" ]; then
  holds python3-lbea '/dist-packages/lbea\.cpython-.*\.so$' '/dist-packages/lbea_client/__init__\.py$' '/lbea_client/_schema/Result\.py$'
  field python3-lbea Depends | grep -qE 'python3 \(>= 3\.[0-9]+~\), python3 \(<< 3\.[0-9]+\)' || fail "python3-lbea does not depend on its Python version"
fi
if [ -n "$(package lbea-bake-mpi)" ]; then
  holds lbea-bake-mpi '/usr/bin/lbea-bake-mpi$' '/usr/share/doc/lbea-bake-mpi/copyright$'
  field lbea-bake-mpi Depends | grep -qi mpi || fail "lbea-bake-mpi does not depend on MPI"
elif [ -x "$build/tools/bake/lbea-bake-mpi" ]; then
  fail "lbea-bake-mpi was built but not packaged"
fi
contents lbea-tools | grep mpi && fail "lbea-tools contains a file that needs MPI"
for name in liblbea0 lbea-tools; do field $name Depends | grep -i mpi && fail "$name depends on MPI"; done
for deb in "$packages"/*.deb; do echo "$(basename "$deb"): $(stat -c %s "$deb") bytes"; done
