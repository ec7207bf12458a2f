# Shared by the cluster tests: programs, the demo ensemble, a folder that is removed at the end.
skip() { echo "skipped: $1"; exit 77; }

bake=$1/tools/bake/lbea-bake
demo=$(cd "$(dirname "${BASH_SOURCE[0]}")/../data/rail-demo" && pwd)
few=(--modes 10 --steps 0,10,20)
folder=$(mktemp -d)
at_the_end() { :; }
trap 'at_the_end; rm -rf "$folder"' EXIT
cd "$folder"
