import sys

import berth

picture = next(berth.Source(sys.argv[1] if len(sys.argv) > 1 else "dock.png"))
height, width = picture.image.shape
camera = berth.CameraModel.paper(width, height)  # yours: berth.CameraModel.read("camera.yaml")
detector = berth.Detector(width, height, camera=camera, marker_size_m=0.1)  # looks for tag36h11 unless told otherwise
for marker in detector.detect(picture.image).detections:
    x, y, z = marker.pose.t  # metres: x right, y down, z away from the camera
    print(f"{marker.family} {marker.id} at {x:.4f} {y:.4f} {z:.4f} m")
