// OpenCV's ArUco by its calls of 4.7 and later, where it lies in objdetect. For earlier versions (Debian 12,
// Ubuntu 22.04 and 24.04), as many of these calls as Berth makes, over contrib's module aruco; cmake/BerthAruco.cmake
// links which it is.
#pragma once

#include <opencv2/core.hpp>

#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7)

#include <opencv2/objdetect/aruco_detector.hpp>

namespace berth::aruco {

using cv::aruco::ArucoDetector;
using cv::aruco::CharucoBoard;
using cv::aruco::DetectorParameters;
using cv::aruco::Dictionary;
using cv::aruco::generateImageMarker;
using cv::aruco::getPredefinedDictionary;

}  // namespace berth::aruco

#else

#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>

namespace berth::aruco {

using cv::aruco::DetectorParameters;
using cv::aruco::Dictionary;

inline Dictionary getPredefinedDictionary(int name) { return *cv::aruco::getPredefinedDictionary(name); }

inline void generateImageMarker(const Dictionary& dictionary, int id, int side_px, cv::OutputArray image) {
  dictionary.drawMarker(id, side_px, image);
}

class CharucoBoard {
 public:
  CharucoBoard(cv::Size squares, float square_side, float marker_side, const Dictionary& dictionary)
      : board_(cv::aruco::CharucoBoard::create(squares.width, squares.height, square_side, marker_side,
                                               cv::makePtr<Dictionary>(dictionary))) {}
  void generateImage(cv::Size size_px, cv::OutputArray image, int margin_px) const {
    board_->draw(size_px, image, margin_px);
  }

 private:
  cv::Ptr<cv::aruco::CharucoBoard> board_;
};

class ArucoDetector {
 public:
  ArucoDetector(const Dictionary& dictionary, const DetectorParameters& parameters)
      : dictionary_(cv::makePtr<Dictionary>(dictionary)), parameters_(cv::makePtr<DetectorParameters>(parameters)) {}
  void detectMarkers(cv::InputArray image, cv::OutputArrayOfArrays corners, cv::OutputArray ids) const {
    cv::aruco::detectMarkers(image, dictionary_, corners, ids, parameters_);
  }

 private:
  cv::Ptr<Dictionary> dictionary_;
  cv::Ptr<DetectorParameters> parameters_;
};

}  // namespace berth::aruco

#endif
