# shellcheck shell=sh
# Networks of a test's own, in which port 3956 is free whatever else is tested on the machine: for scripts to source.

# Runs the script again, with its arguments, in a network of its own whose loopback is up. Exits with 77 where the
# machine has none to give.
enter_own_network() { # SCRIPT ARGUMENTS...
  if [ -z "${IN_OWN_NETWORK:-}" ]; then
    command -v ip >/dev/null || { echo "skipped: no ip (iproute2) here"; exit 77; }
    # As root without a user's namespace, in which there are no real-time priorities.
    for how in -n -rn; do
      if unshare $how true 2>/dev/null; then IN_OWN_NETWORK=1 exec unshare $how "$@"; fi
    done
    echo "skipped: no network namespaces here"
    exit 77
  fi
  ip link set lo up
}

# A second network, beside this one, and a pair of veth between the two, called `pair` in both: 10.77.0.1 here,
# 10.77.0.2 there, with packets of 9000 bytes. The second network is there as long as process $there. Exits with 77
# where the kernel has no veth.
pair_networks() {
  unshare -n sleep infinity &
  there=$!
  while [ "$(readlink "/proc/$there/ns/net")" = "$(readlink /proc/self/ns/net)" ]; do
    kill -0 "$there" 2>/dev/null || { echo "skipped: no second network namespace here"; exit 77; }
    sleep 0.05
  done
  ip link add pair mtu 9000 type veth peer name pair mtu 9000 netns "$there" 2>/dev/null ||
    { kill "$there"; echo "skipped: no veth here"; exit 77; }
  ip address add 10.77.0.1/24 dev pair
  ip link set pair up
  in_there ip address add 10.77.0.2/24 dev pair
  in_there ip link set pair up
  in_there ip link set lo up
}

# A command in the second network, in place of this process where it is exec'ed.
in_there() { # COMMAND...
  nsenter --net="/proc/$there/ns/net" "$@"
}
