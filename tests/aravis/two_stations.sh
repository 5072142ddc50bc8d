#!/bin/sh
# Two GigE Vision cameras at once: two_stations.sh BERTH FAKE_CAMERA ROOT
# The robot's and the dock's, each on an address of its own in a network of its own, show one still moment of a flight.
# `berth stations` says by which it knows the robot's pose: by both, by the dock's alone while the robot's camera is
# dead, by both again; then Ctrl-C ends it. Exits with 77 where the machine has no network to give.
set -eu
. "$(dirname "$0")/own_network.sh"
enter_own_network "$0" "$@"
berth=$1 fake=$2 root=$3
folder=$(mktemp -d)
robot='' dock='' stations=''
finish() {
  for process in $robot $dock $stations; do kill -9 "$process" 2>/dev/null || true; done
  rm -rf "$folder"
}
trap finish EXIT
ip address add 127.0.0.2/8 dev lo
cd "$root"
mkfifo "$folder/open"
exec 9<>"$folder/open" # the cameras' standard input, which never ends

camera() { # SCENARIO ADDRESS
  "$fake" "sim:scenarios/stations-$1.toml" 1 "address=$2" <&9 >"$folder/$1.out" &
}
camera robot 127.0.0.1
robot=$!
camera dock 127.0.0.2
dock=$!
cat >"$folder/camera.yaml" <<END
image_width: 640
image_height: 480
camera_name: paper
camera_matrix: {rows: 3, cols: 3, data: [669.42, 0, 308.825, 0, 672.51, 237.615, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.1116, 0.1242, 0, 0, 0]}
END
station() { # ADDRESS ID CAMERA_AT MARKER_AT
  echo "source = \"aravis:$1,width=640,height=480,fps=30,exposure_us=2000,repeats=on\""
  echo "camera = \"$folder/camera.yaml\""
  echo "marker = \"tag36h11:$2\""
  echo "size = 0.08"
  echo "corners = \"photometric\""
  echo "camera-at = \"$3\""
  echo "marker-at = \"$4\""
}
{
  echo "largest-difference-ms = 17" # half a period: they are not triggered together
  echo "[robot]"
  station 127.0.0.1 7 0,0,0,0,0,0 0,0,0,0,0,0
  echo "[dock]"
  station 127.0.0.2 9 0,0.12,0,0,0,0 0,-0.12,0,0,0,0
} >"$folder/stations.toml"

# Until so many more moments are by that.
wait_for() { # WHO COUNT
  before=$(grep -c "\"by\":\"$1\"" "$folder/log" || true)
  tries=0
  while [ "$(grep -c "\"by\":\"$1\"" "$folder/log" || true)" -lt $((before + $2)) ]; do
    tries=$((tries + 1))
    if [ $tries -gt 600 ] || ! kill -0 "$stations" 2>/dev/null; then
      echo "no more moments by $1"
      cat "$folder/said"
      exit 1
    fi
    sleep 0.1
  done
}
while ! { grep -q ready "$folder/robot.out" && grep -q ready "$folder/dock.out"; }; do sleep 0.1; done
: >"$folder/log"
"$berth" stations "$folder/stations.toml" --json "$folder/log" >"$folder/said" 2>&1 &
stations=$!
wait_for both 10
kill -9 "$robot"
wait_for dock 10
camera robot 127.0.0.1
robot=$!
wait_for both 10
kill -INT "$stations"
code=0
wait "$stations" || code=$?
stations=''
cat "$folder/said"
# 2: the loss was complained of.
[ $code -eq 2 ]
grep -q "^both .* moments: " "$folder/said"
if grep -q "DISAGREE" "$folder/said"; then exit 1; fi
