#!/usr/bin/env bash
# Two MPI ranks make the bytes of a single process.  mpi.sh <folder of the programs>
set -euo pipefail
source "$(dirname "$0")/common.sh"
command -v mpirun >/dev/null || skip "no mpirun here"
[ -x "$bake-mpi" ] || skip "lbea-bake-mpi was not built: no MPI when the build was configured"

"$bake" "$demo/ensemble.toml" "${few[@]}" -o alone.lbea >/dev/null
mpirun --allow-run-as-root --oversubscribe -n 2 "$bake-mpi" "$demo/ensemble.toml" "${few[@]}" --work work -o ranks.lbea >out
grep -q 'samples  *30 of 10 simulations' out
cmp alone.lbea ranks.lbea
# When one rank fails, all ranks fail and none waits for ever.
if timeout 60 mpirun --allow-run-as-root --oversubscribe -n 2 "$bake-mpi" none.toml --work work -o none.lbea 2>err; then exit 1; fi
grep -q none.toml err
[ ! -e none.lbea ]
echo "two ranks, the same bytes"
