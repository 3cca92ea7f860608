#!/usr/bin/env bash
# A private Slurm on this machine alone, for tests: one node, on loopback, own ports.
#   scripts/cluster/slurm.sh up DIR [CPUS [PID]]   start it; all state lies in DIR (4 CPUs)
#   scripts/cluster/slurm.sh down DIR              end it, and what runs in it
# It ends by itself after half an hour, and soon after the process PID has ended.
# Then: export SLURM_CONF=DIR/slurm.conf. Needs root, slurmctld, slurmd, munge.
set -euo pipefail

say() { echo "slurm: $*" >&2; }
fail() { say "$*"; exit 1; }

free_ports() {
  python3 -c '
import socket
sockets = [socket.socket() for _ in range(2)]
for one in sockets:
    one.bind(("127.0.0.1", 0))
print(*(one.getsockname()[1] for one in sockets))'
}

configure() {  # DIR CPUS PORT PORT
  local host
  host=$(hostname -s)
  # FirstJobId: MPICH names shared memory by job and step, and what a killed job leaves of
  # it in /dev/shm breaks the next one of that number.
  # cred_expire: a job may start again at once; KillWait: and KILL follows soon on TERM;
  # KillOnBadExit: as many sites have it; config_overrides: more CPUs than there are.
  cat >"$1/slurm.conf" <<EOF
ClusterName=hpcwhirl
FirstJobId=$((RANDOM * 1000 + 1))
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$1/munge/socket,cred_expire=5
CredType=cred/munge
SlurmctldPort=$3
SlurmdPort=$4
StateSaveLocation=$1/state
SlurmdSpoolDir=$1/spool
SlurmctldPidFile=$1/slurmctld.pid
SlurmdPidFile=$1/slurmd.pid
SlurmctldLogFile=$1/slurmctld.log
SlurmdLogFile=$1/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=5,bf_interval=5,batch_sched_delay=0,sched_min_interval=0
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
JobRequeue=1
KillWait=5
MinJobAge=300
OverTimeLimit=0
SlurmdParameters=config_overrides
KillOnBadExit=1
MailProg=/bin/true
NodeName=$host NodeAddr=127.0.0.1 CPUs=$2 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
EOF
}

guard() {  # DIR PID
  local end=$((SECONDS + 1800))
  while [ -e "$1/slurmctld.pid" ] && [ "$SECONDS" -lt "$end" ]; do
    if [ "$2" != 0 ] && ! kill -0 "$2" 2>/dev/null; then break; fi
    sleep 1
  done
  if [ -e "$1/slurmctld.pid" ]; then down "$1"; fi
}

up() {
  local dir=$1 cpus=$2 owner=$3 name ports
  for name in slurmctld slurmd sbatch munged; do
    command -v "$name" >/dev/null || fail "there is no $name"
  done
  [ "$(id -u)" = 0 ] || fail "it has to be started as root"
  mkdir -p "$dir"/{munge,state,spool}
  dir=$(cd "$dir" && pwd)
  chmod 755 "$dir" "$dir/munge"
  dd if=/dev/urandom of="$dir/key" bs=1024 count=1 status=none
  chmod 400 "$dir/key"
  read -r -a ports < <(free_ports)
  configure "$dir" "$cpus" "${ports[@]}"
  munged --force --key-file="$dir/key" --socket="$dir/munge/socket" \
    --pid-file="$dir/munged.pid" --log-file="$dir/munged.log" \
    --seed-file="$dir/seed" --num-threads=2
  export SLURM_CONF=$dir/slurm.conf
  slurmctld -c -f "$SLURM_CONF"
  slurmd -f "$SLURM_CONF"
  for _ in $(seq 150); do
    if [ "$(sinfo -h -o %T 2>/dev/null)" = idle ]; then
      setsid bash "${BASH_SOURCE[0]}" guard "$dir" "$owner" >/dev/null 2>&1 </dev/null &
      return 0
    fi
    sleep 0.1
  done
  tail -n 20 "$dir"/slurm*.log >&2
  down "$dir"
  fail "the node did not come up"
}

end() {  # PID_FILE: TERM, and KILL after ten seconds
  local pid
  pid=$(cat "$1" 2>/dev/null) || return 0
  kill "$pid" 2>/dev/null || return 0
  for _ in $(seq 100); do
    kill -0 "$pid" 2>/dev/null || return 0
    sleep 0.1
  done
  say "$1: $pid had to be killed"
  kill -9 "$pid" 2>/dev/null || true
}

down() {
  local dir
  dir=$(cd "$1" && pwd)
  export SLURM_CONF=$dir/slurm.conf
  timeout 10 scancel --full --user root 2>/dev/null || true
  for _ in $(seq 100); do
    if [ -z "$(timeout 5 squeue -h 2>/dev/null)" ]; then break; fi
    sleep 0.1
  done
  end "$dir/slurmd.pid"
  end "$dir/slurmctld.pid"
  end "$dir/munged.pid"
}

case ${1:-} in
  up) up "${2:?DIR}" "${3:-4}" "${4:-0}" ;;
  guard) guard "${2:?DIR}" "${3:?PID}" ;;
  down) down "${2:?DIR}" ;;
  *) fail "usage: slurm.sh up DIR [CPUS [PID]] | down DIR" ;;
esac
