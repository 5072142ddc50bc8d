#!/bin/sh
# camera_to_ros.py over a network: camera_to_ros_veth.sh PYTHON BERTH FAKE_CAMERA ROOT [OPTIONS...]
# `berth` is in one network namespace, camera and subscriber are in another, and a pair of veth is between them, so that
# frames, their commands and ROS 2's messages go through Ethernet's drivers and not over loopback. Exits with 77 where
# the machine has none to give.
set -eu
. "$(dirname "$0")/own_network.sh"
enter_own_network "$0" "$@"
python=$1 berth=$2 fake=$3 root=$4
shift 4
folder=$(mktemp -d)
there=''
finish() {
  if [ -n "$there" ]; then kill "$there" 2>/dev/null || true; fi
  rm -rf "$folder"
}
trap finish EXIT
pair_networks
# Replaced by the program, so that its process is the one that the test sees.
printf '#!/bin/sh\nexec nsenter --net=/proc/%s/ns/net "%s" "$@"\n' "$there" "$berth" >"$folder/berth"
chmod +x "$folder/berth"
export BERTH_TEST_CAMERA=10.77.0.1
export CYCLONEDDS_URI='<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface name="pair"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
<Peers><Peer address="10.77.0.1"/><Peer address="10.77.0.2"/></Peers></Discovery></Domain></CycloneDDS>'
"$python" "$(dirname "$0")/camera_to_ros.py" "$folder/berth" "$fake" "$root" "$@"
in_there ip -s link show pair
