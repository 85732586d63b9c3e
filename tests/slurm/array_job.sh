#!/usr/bin/env bash
# A study as an array job on a Slurm of one node, with daemons, key, ports and directories of its own, gone at the end.
#   array_job.sh BIN_DIR CONFIG_DIR
# Exit code 77 (skipped) with a reason where Slurm is not installed or cannot be started here.
set -euo pipefail
bin=$(readlink -f "$1") config=$(readlink -f "$2")

skip() { echo "skipped: $*"; exit 77; }
fail() { echo "failed: $*" >&2; tail -n 20 "$work"/*.log >&2 || true; exit 1; }

PATH=$PATH:/usr/sbin
for program in munged slurmctld slurmd sbatch squeue sinfo; do
  command -v $program >/dev/null || skip "$program is not installed (Debian: slurmctld slurmd slurm-client munge; ./dev soak slurm installs them)"
done
((EUID == 0)) || skip "slurmd starts jobs as root only"

work=$(mktemp -d /tmp/takt_slurm.XXXXXX)
host=$(hostname -s)
daemons=()
stop_all() {
  local i
  for ((i = ${#daemons[@]} - 1; i >= 0; --i)); do kill "${daemons[i]}" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$work"
}
trap stop_all EXIT

# wait_for SECONDS COMMAND...: until it succeeds.
wait_for() {
  local end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < end)) || return 1
    read -rt 0.2 <> <(:) || true
  done
}
free_port() {
  local port
  for port in $(shuf -i 20000-29999 -n 50); do
    if ! grep -qi ":$(printf %04X "$port") " /proc/net/tcp /proc/net/tcp6 2>/dev/null; then
      echo "$port"
      return
    fi
  done
}

chmod 755 "$work"
mkdir -m 700 "$work/munge" "$work/state" "$work/spool"
(umask 077 && head -c 1024 /dev/urandom >"$work/munge/key")
mkdir -m 755 "$work/socket"
munged --foreground --force --key-file "$work/munge/key" --socket "$work/socket/munge" --pid-file "$work/munge/pid" \
  --seed-file "$work/munge/seed" --log-file "$work/munge/munged.log" >"$work/munged.log" 2>&1 &
daemons+=($!)
wait_for 30 test -S "$work/socket/munge" || skip "munged does not start: $(tail -n 1 "$work/munged.log")"

cat >"$work/slurm.conf" <<CONF
ClusterName=takt
SlurmctldHost=$host(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$work/socket/munge
SlurmUser=root
SlurmdUser=root
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
ReturnToService=2
MailProg=/bin/true
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
slurmctld -D -i >"$work/slurmctld.out.log" 2>&1 &
daemons+=($!)
slurmd -D -N "$host" >"$work/slurmd.out.log" 2>&1 &
daemons+=($!)
node_is_idle() { [[ $(sinfo -h -o %T) == idle ]]; }
wait_for 60 node_is_idle ||
  skip "Slurm does not come up here: $(cat "$work"/slurmctld.log "$work"/slurmd.log "$work"/*.out.log 2>/dev/null | grep -iE 'error|fatal' | tail -n 2)"

# The study: six runs; the reference is the same one without Slurm.
study=("$bin/takt-run" study "$config/scenarios/contact/sliding_block.yaml" --vary contact.defaults.friction=0.1:0.3:3
  --vary parts.Slab.mass_kg=0.5:1:2)
nothing_queued() { [[ -z $(squeue -h) ]]; }
mkdir "$work/study"
"${study[@]}" --table "$work/study/array.csv" --slurm "$work/study/job"
"$work/study/job/submit.sh"
wait_for 300 nothing_queued || fail "the jobs do not end: $(squeue)"
[[ -s $work/study/array.csv && -s $work/study/array.svg ]] || fail "no table: $(cat "$work"/study/job/*.log)"
[[ $(ls "$work"/study/job/task_*.log | wc -l) == 6 ]] || fail "not six tasks"
grep -q '6 of 6 runs were done before' "$work/study/job/table.log" || fail "the table's job had runs to do: $(cat "$work/study/job/table.log")"
"${study[@]}" --table "$work/study/plain.csv" --quiet
# Computation times differ, all else is the same.
without_times() { awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "computation_ratio") skip = i } { $skip = ""; print }' "$1"; }
diff <(without_times "$work/study/array.csv") <(without_times "$work/study/plain.csv") || fail "the tables differ"

# Submitted again, with two runs lost: these alone are done.
rm "$work"/study/array.csv "$work"/study/array.csv.runs/00000[14].json
touch -d '2000-01-01' "$work"/study/array.csv.runs/*.json
"$work/study/job/submit.sh"
wait_for 300 nothing_queued || fail "the jobs do not end: $(squeue)"
[[ $(find "$work/study/array.csv.runs" -name '*.json' -newermt '2001-01-01' | wc -l) == 2 ]] || fail "not the two lost runs alone"
diff <(without_times "$work/study/array.csv") <(without_times "$work/study/plain.csv") || fail "the tables differ"
echo "six runs by six tasks, the same table as without Slurm; submitted again: the two lost runs alone"
