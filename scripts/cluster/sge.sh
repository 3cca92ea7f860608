#!/usr/bin/env bash
# A private Grid Engine on this machine alone, for tests: one node, cut off from every
# network but loopback, in namespaces of its own, with which all that runs in it ends.
#   scripts/cluster/sge.sh up DIR [SLOTS [PID]]   start it; all state lies in DIR (4 slots)
#   scripts/cluster/sge.sh in DIR COMMAND...      run qsub, qstat, ... there
#   scripts/cluster/sge.sh down DIR               end it, and what runs in it
# It ends by itself after half an hour, and soon after the process PID has ended.
# Needs root, unshare, nsenter, ip, and Debian's gridengine-master, -exec and -client.
set -euo pipefail

tools=/usr/lib/gridengine shared=/usr/share/gridengine
host=gridengine
say() { echo "sge: $*" >&2; }
fail() { say "$*"; exit 1; }

bootstrap() {  # DIR: as Debian's, with all state in DIR
  sed -e 's|^admin_user .*|admin_user none|' \
    -e "s|^spooling_params .*|spooling_params $1/spooldb|" \
    -e "s|^binary_path .*|binary_path $tools|" \
    -e "s|^qmaster_spool_dir .*|qmaster_spool_dir $1/qmaster|" \
    "$shared/default-bootstrap" >"$1/default/common/bootstrap"
  # min_uid: root's jobs, too; the accounting is told at once
  sed -e "s|^execd_spool_dir .*|execd_spool_dir $1/execd|" \
    -e 's|^mailer .*|mailer /bin/true|' \
    -e 's|^\(min_[ug]id\) .*|\1 0|' \
    -e 's|^load_report_time .*|load_report_time 00:00:01|' \
    -e 's|^reporting_params .*|reporting_params accounting=true reporting=false flush_time=00:00:01 joblog=false sharelog=00:00:00|' \
    "$shared/default-configuration" >"$1/configuration"
  echo "$host" >"$1/default/common/act_qmaster"
  echo "$host localhost" >"$1/default/common/host_aliases"
}

spool() {  # DIR
  "$tools/spoolinit" berkeleydb libspoolb "$1/spooldb" init
  "$tools/spooldefaults" configuration "$1/configuration"
  "$tools/spooldefaults" complexes "$shared/util/resources/centry"
  "$tools/spooldefaults" usersets "$shared/util/resources/usersets"
  "$tools/spooldefaults" managers root
}

queue() {  # DIR SLOTS: one queue of one node, a parallel environment mpi
  local conf=$1/conf
  qconf -as "$host"
  qconf -ssconf | sed -e 's|^schedule_interval .*|schedule_interval 0:0:1|' \
    -e 's|^\(flush_[a-z]*_sec\) .*|\1 1|' >"$conf"
  qconf -Msconf "$conf"
  sed "s|^slots .*|slots $2|" "$shared/util/resources/pe/mpi" >"$conf"
  qconf -Ap "$conf"
  qconf -sq | sed -e 's|^qname .*|qname all.q|' -e "s|^hostlist .*|hostlist $host|" \
    -e "s|^slots .*|slots $2|" -e 's|^pe_list .*|pe_list mpi|' \
    -e 's|^load_thresholds .*|load_thresholds NONE|' >"$conf"
  qconf -Aq "$conf"
}

hold() {  # DIR SLOTS: process 1 of its namespaces
  hostname "$host"
  ip link set lo up
  printf '127.0.0.1 %s localhost\n' "$host" >"$1/hosts"
  mount --bind "$1/hosts" /etc/hosts
  bootstrap "$1"
  spool "$1"
  export SGE_ND=1  # no daemons: children of this process
  "$tools/sge_qmaster" &
  for _ in $(seq 150); do
    if qconf -sh >/dev/null 2>&1; then break; fi
    sleep 0.1
  done
  queue "$1" "$2"
  "$tools/sge_execd" &
  touch "$1/ready"
  while :; do wait || true; sleep 1; done
}

guard() {  # DIR PID
  local end=$((SECONDS + 1800))
  while [ -e "$1/holder" ] && [ "$SECONDS" -lt "$end" ]; do
    if [ "$2" != 0 ] && ! kill -0 "$2" 2>/dev/null; then break; fi
    sleep 1
  done
  down "$1"
}

inside() {  # DIR COMMAND...
  local first
  first=$(cat "$1/first") || fail "nothing runs in $1"
  SGE_ROOT=$1 SGE_CELL=default PATH=$tools:$PATH nsenter --target "$first" \
    --net --mount --uts --pid --wdns="$PWD" -- "${@:2}"
}

idle() {  # DIR
  [ -e "$1/ready" ] && inside "$1" qstat -f 2>/dev/null | grep -q '^all.q@.* lx-[a-z0-9]* *$'
}

up() {
  local dir=$1 slots=$2 owner=$3 name holder
  for name in unshare nsenter ip pgrep; do
    command -v "$name" >/dev/null || fail "there is no $name"
  done
  for name in sge_qmaster sge_execd qsub; do
    [ -x "$tools/$name" ] || fail "there is no $tools/$name"
  done
  [ "$(id -u)" = 0 ] || fail "it has to be started as root"
  mkdir -p "$dir"/{default/common,spooldb,qmaster/job_scripts,execd,util}
  dir=$(cd "$dir" && pwd)
  # shellcheck disable=SC2064  # the directory of now
  trap "down '$dir'" EXIT  # also where it is broken off meanwhile
  ln -sf "$shared/util/arch" "$shared/util/arch_variables" "$dir/util/"
  SGE_ROOT=$dir SGE_CELL=default PATH=$tools:$PATH setsid unshare --net --mount --uts \
    --pid --fork --kill-child --mount-proc \
    bash "${BASH_SOURCE[0]}" hold "$dir" "$slots" >"$dir/log" 2>&1 </dev/null &
  holder=$!
  echo "$holder" >"$dir/holder"
  for _ in $(seq 300); do
    kill -0 "$holder" 2>/dev/null || break
    pgrep -P "$holder" >"$dir/first" || true
    if idle "$dir"; then
      setsid bash "${BASH_SOURCE[0]}" guard "$dir" "$owner" >/dev/null 2>&1 </dev/null &
      trap - EXIT
      return 0
    fi
    sleep 0.1
  done
  tail -n 20 "$dir/log" "$dir"/*/messages "$dir"/execd/*/messages >&2 || true
  fail "the node did not come up"
}

down() {  # the first process of the namespaces takes all others with it
  local holder
  holder=$(cat "$1/holder" 2>/dev/null) || return 0
  kill -9 "$holder" 2>/dev/null || true
  for _ in $(seq 100); do
    kill -0 "$(cat "$1/first")" 2>/dev/null || break
    sleep 0.1
  done
  rm -f "$1/holder" "$1/first" "$1/ready"
}

case ${1:-} in
  up) up "${2:?DIR}" "${3:-4}" "${4:-0}" ;;
  hold) hold "${2:?DIR}" "${3:?SLOTS}" ;;
  guard) guard "${2:?DIR}" "${3:?PID}" ;;
  in) inside "$(cd "${2:?DIR}" && pwd)" "${@:3}" ;;
  down) down "$(cd "${2:?DIR}" && pwd)" ;;
  *) fail "usage: sge.sh up DIR [SLOTS [PID]] | in DIR COMMAND... | down DIR" ;;
esac
