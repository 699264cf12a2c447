#!/usr/bin/env bash
# A sweep as an array on a real Slurm, with a node lost on the way, gives the bytes of a run on one machine.
#
# Slurm is Debian's slurm-wlm, installed if it is missing and this is root, and started here for this test
# alone: one controller and two nodes, all on this machine, without systemd, in a folder that is removed at
# the end. What cannot be had is said in a line that begins with SKIPPED, and is no failure.
#
#   tests/slurm.sh PATH-OF-PTM
set -euo pipefail

ptm=$(realpath "$1")
root=$(cd "$(dirname "$0")/.." && pwd)
skip() { echo "SKIPPED: Slurm: $1"; exit 0; }
say() { printf '   %4ss  %s\n' "$SECONDS" "$1"; }

[ "$(id -u)" = 0 ] || skip "its daemons want root, this is $(id -un)"
export PATH="$PATH:/usr/sbin:/sbin"
if ! command -v slurmctld > /dev/null || ! command -v slurmd > /dev/null || ! command -v munged > /dev/null; then
    command -v apt-get > /dev/null || skip "slurm-wlm is not installed, and this is no Debian"
    say "installing slurm-wlm"
    { timeout 60 apt-get update && DEBIAN_FRONTEND=noninteractive timeout 180 \
        apt-get install -y --no-install-recommends slurm-wlm munge; } > /dev/null 2>&1 \
        || skip "slurm-wlm is not installed, and apt-get cannot install it"
fi

work=$(mktemp -d /tmp/ptm-slurm.XXXXXX)
chmod 755 "$work"
pids=()
finish() {
    status=$?
    if [ $status -ne 0 ]; then
        for log in "$work"/*.log "$work"/out/slurm/*.log; do
            [ -s "$log" ] && { echo "--- $log"; tail -n 15 "$log"; }
        done
    fi
    # Only what was started here, the steps of jobs first.
    for file in "$work"/*.pid; do
        [ -s "$file" ] && pids+=("$(cat "$file")")
    done
    for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null || true; done
    for _ in $(seq 20); do
        alive=0
        for pid in "${pids[@]}"; do kill -0 "$pid" 2> /dev/null && alive=1; done
        [ $alive = 0 ] && break
        sleep 0.1
    done
    for pid in "${pids[@]}"; do kill -9 "$pid" 2> /dev/null || true; done
    rm -rf "$work"
    exit $status
}
trap finish EXIT

host=$(hostname -s)
cores=$(nproc)
port=$((20000 + RANDOM % 20000))
mkdir "$work/state" "$work/spool1" "$work/spool2" "$work/munge"
# A socket and key of our own, so that a munge that runs here already is left alone.
head -c 1024 /dev/urandom > "$work/munge/key"
chmod 400 "$work/munge/key"
chmod 711 "$work" "$work/munge"
munged --force --key-file="$work/munge/key" --socket="$work/munge/socket" \
    --pid-file="$work/munged.pid" --log-file="$work/munged.log" --seed-file="$work/munge/seed" \
    || skip "munged does not start"

# cred_expire: a requeued job waits for the credential of its lost run to expire, two minutes by default.
cat > "$work/slurm.conf" <<CONF
ClusterName=ptm
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket,cred_expire=5
CredType=cred/munge
SlurmctldPort=$port
SlurmctldPidFile=$work/slurmctld.pid
SlurmctldLogFile=$work/slurmctld.log
StateSaveLocation=$work/state
SlurmdPidFile=$work/slurmd-%n.pid
SlurmdLogFile=$work/slurmd-%n.log
SlurmdSpoolDir=$work/spool-%n
ProctrackType=proctrack/pgid
JobAcctGatherType=jobacct_gather/none
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SlurmdTimeout=5
SlurmctldTimeout=5
SchedulerParameters=sched_interval=1,batch_sched_delay=0,requeue_delay=0
MaxArraySize=4
KillWait=2
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=$cores State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=$cores State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:4
CONF
export SLURM_CONF="$work/slurm.conf"
mkdir "$work/spool-n1" "$work/spool-n2"

slurmctld -D > "$work/slurmctld.out.log" 2>&1 &
pids+=($!)
slurmd -D -N n1 > "$work/slurmd-n1.out.log" 2>&1 &
pids+=($!)
slurmd -D -N n2 > "$work/slurmd-n2.out.log" 2>&1 &
node2=$!
pids+=($node2)
for _ in $(seq 100); do
    [ "$(sinfo -h -N -o %T 2> /dev/null | grep -c idle)" = 2 ] && break
    sleep 0.1
done
[ "$(sinfo -h -N -o %T 2> /dev/null | grep -c idle)" = 2 ] || skip "its nodes do not come up"
say "Slurm is up: $(sinfo -h -N -o '%N %T' | tr '\n' ' ')"

cd "$work"
cp "$root/sweeps/smoke.toml" sweep.toml
sed -i 's/^samples = .*/samples = 200000/' sweep.toml
"$ptm" submit --slurm sweep.toml --shards 6 --out "a folder"
say "submitted"
# A job counts as running from the moment it is handed to a node, before any process of it is there: what is
# waited for is a chain at work, and what is looked for afterwards is every process that names the node.
processes_on() {
    { grep -lzxF "SLURMD_NODENAME=$1" /proc/[0-9]*/environ || true; } 2> /dev/null \
        | { xargs -r grep -lzxF "SLURM_CONF=$work/slurm.conf" || true; } 2> /dev/null \
        | cut -d / -f 3
}
at_work() {
    for pid in $(processes_on "$1"); do
        [ "$(cat "/proc/$pid/comm" 2> /dev/null)" = ptm ] && return 0
    done
    return 1
}
for _ in $(seq 300); do
    at_work n2 && break
    sleep 0.1
done
at_work n2 || { echo "nothing ran on the second node"; squeue; exit 1; }

# The second node is lost: its daemon and all that ran on it, without a word to anybody.
disown "$node2"
kill -9 "$node2"
n_lost=0
for _ in 1 2 3; do
    for pid in $(processes_on n2); do
        parent=$(awk '/^PPid:/ {print $2}' "/proc/$pid/status" 2> /dev/null || true)
        [ "$(cat "/proc/$parent/comm" 2> /dev/null)" = slurmstepd ] && kill -9 "$parent" 2> /dev/null || true
        kill -9 "$pid" 2> /dev/null && n_lost=$((n_lost + 1))
    done
    sleep 0.2
done
[ $n_lost -gt 0 ] || { echo "no process was lost with the node"; exit 1; }
say "lost the second node with $n_lost processes"

# The merge waits for every shard, the requeued ones too.
for _ in $(seq 900); do
    squeue -h > "$work/queue" 2> /dev/null && [ ! -s "$work/queue" ] && break
    sleep 0.1
done
[ ! -s "$work/queue" ] || { echo "jobs are still there:"; squeue; exit 1; }
say "all jobs have ended"
requeued=$(find "$work/a folder/shards" -name '*.2.jsonl' | wc -l)
[ "$requeued" -gt 0 ] || { echo "no shard was started twice"; exit 1; }
grep -q "48 of 48 chains have a record" "$work/a folder/slurm/"*merge.log \
    || { cat "$work/a folder/slurm/"*merge.log; echo "the merge did not find every chain"; exit 1; }

"$ptm" submit --slurm sweep.toml --shards 6 --out "a folder" | grep -q "every chain has a record"
"$ptm" --quiet sweep sweep.toml --out single
# All but what says when and where.
diff -r -x run.json -x 'timings.*' -x journal.jsonl -x shards -x slurm -x timing* single "a folder"
diff <(sort single/journal.jsonl) <(sort "a folder/journal.jsonl")
say "PASSED: $requeued shards were requeued; the bytes are those of a run on one machine"
