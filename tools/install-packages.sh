#!/usr/bin/env bash
# Installs the packages for one purpose on Debian 12. Returns at once when all of them are installed.
#   bash tools/install-packages.sh demo      the five programs of tools/demo.sh
#   bash tools/install-packages.sh picture   its picture
#   bash tools/install-packages.sh monitor   the five programs and lbea-monitor, whose page npm builds
#   bash tools/install-packages.sh build     every program, the Python module, manual pages and Debian packages
#   bash tools/install-packages.sh test      also the tests (default)
#   bash tools/install-packages.sh cross     compilers for Linux on ARM64 and Windows, and emulators for the tests (300 MB)
set -euo pipefail
purpose=${1:-test}
demo=(
  clang cmake ninja-build patch pkg-config         # clang compiles the demo faster than GCC
  libxxhash-dev                                    # runtime: checksums, header-only
  libeigen3-dev libnanoflann-dev                   # bake: matrices, k-d tree
  cppzmq-dev libzmq3-dev libsodium-dev             # ZeroMQ; its source is patched and built (third_party/zmq)
  libflatbuffers-dev flatbuffers-compiler          # messages
  libisal-dev liblz4-dev libzstd-dev zlib1g-dev    # recordings: checksums, compressed chunks
  libtomlplusplus-dev nlohmann-json3-dev           # ensemble and sensor descriptions
  libpugixml-dev liblzf-dev                        # VTK's XML files, packed PCD clouds
  libcli11-dev libspdlog-dev                       # programs
)
picture=(python3 python3-numpy python3-pil fonts-dejavu-core)
monitor=(
  "${demo[@]}"
  libboost-dev                                     # HTTP: Beast, header-only
)
# Node.js may be installed from another source than Debian.
command -v npm >/dev/null && command -v node >/dev/null || monitor+=(nodejs npm)
build=(
  "${monitor[@]}" "${picture[@]}" build-essential git
  python3-matplotlib                               # figures of evaluations
  libbenchmark-dev                                 # benchmark of single loops
  libhdf5-dev                                      # VTKHDF files; without it they are refused
  pybind11-dev python3-dev python3-zmq python3-flatbuffers         # Python
  libopenmpi-dev openmpi-bin                       # bake on clusters: the optional MPI driver
  help2man doxygen file                            # manual pages, reference, Debian packages
)
test=(
  "${build[@]}"
  doctest-dev libclang-rt-14-dev                   # the test framework, clang's sanitizers
  clang-format universal-ctags                     # checks of format and of duplicate types
  python3-vtk9                                     # reference reader of VTU files
  chromium                                         # browser tests of the monitor's page
  debootstrap                                      # a minimal Debian for the packages
  slurmctld slurmd slurm-client munge              # a one-node Slurm
)
cross=(
  "${test[@]}"
  g++-aarch64-linux-gnu qemu-user                  # preset arm64
  g++-mingw-w64-x86-64-posix llvm wine64           # preset windows
)
case "$purpose" in
  demo) packages=("${demo[@]}") ;;
  picture) packages=("${picture[@]}") ;;
  monitor) packages=("${monitor[@]}") ;;
  build) packages=("${build[@]}") ;;
  test) packages=("${test[@]}") ;;
  cross) packages=("${cross[@]}") ;;
  *) echo "usage: bash tools/install-packages.sh [demo | picture | monitor | build | test | cross]" >&2; exit 2 ;;
esac
missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0
as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
"${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
