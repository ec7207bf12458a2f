#!/usr/bin/env bash
# A one-node Slurm runs the job script on the demo, with a task that is killed on the way, and the merge behind it: the
# bytes of a single process.  slurm.sh <folder of the programs>; needs root.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
[ "$(id -u)" -eq 0 ] || skip "needs root, to start munged, slurmctld and slurmd"
for program in munged slurmctld slurmd sbatch; do command -v $program >/dev/null || skip "no $program here"; done

pids=()
at_the_end() {
  if [ -e held/process ]; then kill -KILL "$(cat held/process)" 2>/dev/null || true; fi  # a stopped process would stay for ever
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null || true; done
}
waits() {  # for a command to succeed, at most a minute
  for _ in $(seq "${patience:-600}"); do "$@" >/dev/null 2>&1 && return; sleep 0.1; done
  echo "still not: $*"; cat ./*.log; return 1
}

# All files of this Slurm are in the test's folder, and it uses its own ports.
mkdir -p munge slurm spool/d
chmod 755 .  # munged requires that others can reach its socket and cannot write to its parent folders
chmod 711 munge
dd if=/dev/urandom of=munge/key bs=1024 count=1 status=none
chmod 400 munge/key
munged --foreground --force --key-file="$PWD/munge/key" --socket="$PWD/munge/socket" --pid-file="$PWD/munge/pid" \
  --log-file="$PWD/munge.log" --seed-file="$PWD/munge/seed" >munged.out 2>&1 &
pids+=($!)
waits test -S munge/socket
read -r low _ </proc/sys/net/ipv4/ip_local_port_range
port=$((low - 200 + $$ % 100))
cat >slurm/slurm.conf <<CONF
ClusterName=test
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmUser=root
SlurmctldPort=$port
SlurmdPort=$((port + 100))
AuthType=auth/munge
AuthInfo=socket=$PWD/munge/socket
CredType=cred/munge
StateSaveLocation=$PWD/spool
SlurmdSpoolDir=$PWD/spool/d
SlurmctldPidFile=$PWD/slurmctld.pid
SlurmdPidFile=$PWD/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=bf_interval=1,sched_min_interval=0
MinJobAge=2
MpiDefault=none
ReturnToService=2
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
echo 'CgroupPlugin=cgroup/v1' >slurm/cgroup.conf
export SLURM_CONF=$PWD/slurm/slurm.conf
slurmctld -D -i >slurmctld.log 2>&1 &
pids+=($!)
slurmd -D >slurmd.log 2>&1 &
pids+=($!)
waits sh -c 'sinfo -h -o %T | grep -q idle'

# The first process of shard 2 stops as soon as it is in the middle of a record, so that it is killed there.
mkdir once
cat >once/lbea-bake <<WRAPPER
#!/bin/bash
[ "\$1" = shard ] && [ "\${SLURM_ARRAY_TASK_ID:-}" = 2 ] && mkdir "$PWD/held" 2>/dev/null || exec "$bake" "\$@"
is_writing() {  # has locked its temporary file
  local file
  for file in "$PWD/work/record/"*.tmp-\$1-*; do [ -e "\$file" ] && ! flock -n "\$file" true && return; done
  return 1
}
"$bake" "\$@" &
while kill -STOP \$! && ! is_writing \$!; do kill -CONT \$!; done  # in a pause the task could finish
echo \$! >"$PWD/held/process.tmp" && mv "$PWD/held/process.tmp" "$PWD/held/process"
wait \$!
WRAPPER
chmod 755 once/lbea-bake
PATH=$PWD/once:$PATH
export PATH
lbea-bake "$demo/ensemble.toml" "${few[@]}" -o alone.lbea >/dev/null
lbea-bake plan "$demo/ensemble.toml" "${few[@]}" --work work -o array.lbea
script=$here/../../docs/examples/cluster/bake.slurm
array=$(sbatch --parsable --array=0-3 "$script" work)
waits test -e held/process
held=$(cat held/process)
[ "$(squeue -h -j "${array}_2" -o %T)" = RUNNING ]
[ "$(cut -d' ' -f3 "/proc/$held/stat")" = T ]
lbea-bake status --work work | tee status | grep -q 'running   [1-9]' || { cat status; compgen -G "work/*/*.tmp-*"; exit 1; }
kill -KILL "$held"  # like the kernel's out-of-memory killer; scancel would let the process clean up
waits test ! -e "/proc/$held"
compgen -G "work/record/*.tmp-$held-*" >/dev/null  # its temporary file; the next array makes the missing runs
waits sh -c "lbea-bake status --work work | grep -q 'running   0'"  # the others have finished
again=$(sbatch --parsable --array=0-2 --dependency=afterany:"$array" "$script" work)
merge=$(sbatch --parsable --dependency=afterany:"$again" --wrap "lbea-bake merge --work work")
waits test -e array.lbea
cmp alone.lbea array.lbea
lbea-bake status --work work | grep -q 'finished  10 of 10'
! compgen -G "work/*/*.tmp-*"
echo "jobs $array (process $held killed in the middle of a record), $again, $merge: the same bytes"
