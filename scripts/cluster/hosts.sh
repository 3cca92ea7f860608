#!/usr/bin/env bash
# A campaign on two "hosts" of this machine, for real: two network namespaces with host
# names of their own, joined by a veth pair, MPICH between them over TCP alone.
#   sudo bash scripts/cluster/hosts.sh [RANKS, default 4]
# Runs a small campaign there and in one process, and compares the bits. Needs root, ip,
# unshare, and the MPICH of the environment ($HPCWHIRL_MPIRUN, else mpirun).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
ranks=${1:-4}
limit=${HPCWHIRL_HOSTS_LIMIT:-240}  # s, of the campaign on two hosts
mpirun=$(command -v "${HPCWHIRL_MPIRUN:-mpirun}") || { echo "hosts: no mpirun" >&2; exit 2; }
[ "$(id -u)" = 0 ] || { echo "hosts: network namespaces need root" >&2; exit 2; }
for tool in ip unshare; do
  command -v "$tool" >/dev/null || { echo "hosts: $tool is missing" >&2; exit 2; }
done
case $("$mpirun" --version 2>&1) in
  *HYDRA*) ;;
  *) echo "hosts: $mpirun is not MPICH's; this uses its -launcher-exec" >&2; exit 2 ;;
esac

tag=hpcw$$
scratch=$(mktemp -d)
teardown() {
  local host pid
  for host in a b; do
    for pid in $(ip netns pids "$tag-$host" 2>/dev/null); do
      kill -9 "$pid" 2>/dev/null || true
    done
    ip netns delete "$tag-$host" 2>/dev/null || true  # takes its end of the pair along
  done
  rm -rf "$scratch"
}
trap teardown EXIT

ip netns add "$tag-a"
ip netns add "$tag-b"
ip link add hpcw0 netns "$tag-a" type veth peer name hpcw0 netns "$tag-b"
number=0
for host in a b; do
  number=$((number + 1))
  ip -n "$tag-$host" link set lo up
  ip -n "$tag-$host" address add "10.213.77.$number/24" dev hpcw0
  ip -n "$tag-$host" link set hpcw0 up
done
for host in a b; do  # MPI passes by a link that is not up yet
  for _ in $(seq 100); do
    case $(ip -n "$tag-$host" -br link show hpcw0) in *" UP "*) break ;; esac
    sleep 0.1
  done
done

# What enters a host: its network, a host name and shared memory of its own.
cat >"$scratch/enter" <<END
#!/usr/bin/env bash
host=\$1; shift
export UCX_NET_DEVICES=hpcw0 FI_TCP_IFACE=hpcw0 FI_PROVIDER=tcp
exec ip netns exec "$tag-\$host" unshare --uts --ipc --mount bash -c '
  hostname "host-\$0" && mount -t tmpfs none /dev/shm && exec bash -c "\$*"' "\$host" "\$@"
END
# Stands where ssh would: [options] ADDRESS COMMAND...
cat >"$scratch/ssh" <<END
#!/usr/bin/env bash
while [ "\${1#-}" != "\$1" ]; do shift; done
case \$1 in 10.213.77.1) host=a ;; 10.213.77.2) host=b ;; *) echo "no host \$1" >&2; exit 255 ;; esac
shift
exec "$scratch/enter" "\$host" "\$@"
END
chmod +x "$scratch/enter" "$scratch/ssh"

cat >"$scratch/campaign.toml" <<END
scene = {duration = 0.4}
solver = {time_step = 2e-6}
output = {interval = 1e-3}
sweep = {speed = {start = 300, stop = 500, step = 10}, friction = [0.0, 0.1]}
END
call=(python -m hpcwhirl campaign "$scratch/campaign.toml")
export PYTHONPATH=$PWD OMP_NUM_THREADS=1
"${call[@]}" --out "$scratch/one" >/dev/null

echo "hosts: $ranks ranks on host-a (10.213.77.1) and host-b (10.213.77.2)"
words=$(printf '%q ' timeout "$limit" "$mpirun" -launcher ssh -launcher-exec "$scratch/ssh" \
  -hosts 10.213.77.1,10.213.77.2 -n "$ranks" "${call[@]}" --out "$scratch/two")
"$scratch/enter" a "$words" >/dev/null

python - "$scratch/one/results.h5" "$scratch/two/results.h5" <<'END'
import collections
import sys

import h5py

with h5py.File(sys.argv[1]) as one, h5py.File(sys.argv[2]) as two:
    names = [n for n, d in one.items() if isinstance(d, h5py.Dataset)]
    other = [n for n, d in two.items() if isinstance(d, h5py.Dataset)]
    differ = [n for n in names if one[n][()].tobytes() != two[n][()].tobytes()]
    hosts = collections.Counter(h.decode() for h in two["performance/host"][:])
    print("hosts: cases by host:", dict(hosts), "ranks:", two.attrs["ranks"].decode())
    for values in zip(*(two[f"performance/{n}"] for n in ("worker_host", "worker_rank",
                      "worker_cases", "busy_fraction"))):
        print("hosts: {} rank {}: {} cases, busy {:.3f}".format(values[0].decode(), *values[1:]))
    if names != other or differ or len(hosts) != 2:
        sys.exit(f"hosts: FAILED, differing variables: {differ}")
    print(f"hosts: {len(names)} variables have the bits of one process")
END
