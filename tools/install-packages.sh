#!/usr/bin/env bash
# Installs what the build and the tests need on Debian 12. Does nothing, quickly, when all of it is there.
set -euo pipefail
packages=(
  build-essential cmake ninja-build git pkg-config
  libxxhash-dev                                    # runtime: checksums, header-only
  libeigen3-dev libspectra-dev libembree-dev       # bake: matrices, eigen-solver, ray casting
  cppzmq-dev libzmq3-dev libflatbuffers-dev flatbuffers-compiler   # wire
  libisal-dev liblz4-dev libzstd-dev zlib1g-dev    # recordings: checksums, compressed chunks
  libtomlplusplus-dev nlohmann-json3-dev           # ensemble and sensor descriptions
  libpugixml-dev liblzf-dev                        # VTK's XML files, packed PCD clouds
  libcli11-dev libspdlog-dev                       # programs
  libboost-dev                                     # metrics: Beast, headers alone
  libnanoflann-dev libbenchmark-dev                # benchmark: a baseline, loops one by one
  pybind11-dev python3-dev python3-zmq python3-flatbuffers         # Python
  help2man doxygen file debootstrap                # manual pages, reference, Debian packages and their test
  libboost-dev chromium                            # monitor: its web server; the browser that tests its page
  libopenmpi-dev openmpi-bin                       # bake on clusters: the optional MPI driver
  slurmctld slurmd slurm-client munge              # tests: a one-node Slurm
  clang-format                                     # tests: the form of the sources
  doctest-dev python3-vtk9                         # tests: the runner, an oracle for VTU
  python3 python3-numpy python3-matplotlib         # pictures of the demo
)
# The monitor's page; Node may have come from elsewhere than Debian.
command -v npm >/dev/null && command -v node >/dev/null || packages+=(nodejs npm)
missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0
as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
"${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
