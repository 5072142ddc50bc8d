# BERTH_ARUCO_MODULE: the OpenCV module whose calls src/target/opencv_aruco.hpp makes. From 4.7 on ArUco is in objdetect,
# before that in contrib's aruco. Empty without OpenCV.
find_package(OpenCV QUIET COMPONENTS core)
if(NOT OpenCV_FOUND)
  set(BERTH_ARUCO_MODULE "")
elseif(OpenCV_VERSION VERSION_LESS 4.7)
  set(BERTH_ARUCO_MODULE aruco)
else()
  set(BERTH_ARUCO_MODULE objdetect)
endif()
