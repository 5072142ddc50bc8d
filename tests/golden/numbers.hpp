#pragma once

#include <string>

#include "berth/bundle.hpp"
#include "berth/marker.hpp"
#include "berth/navigator.hpp"
#include "berth/pose_filter.hpp"
#include "berth/stations.hpp"
#include "golden/lines.hpp"
#include "navigation/window_scorer.hpp"

namespace berth::golden {

// Every number of a result. What people look at stands there as it is; covariances and the second solution's numbers
// are digests.
void write(Lines& lines, const std::string& name, const Detection& marker);
void write(Lines& lines, const std::string& name, const BundlePose& bundle);
void write(Lines& lines, const std::string& name, const FilteredPose& filtered);
void write(Lines& lines, const std::string& name, const RelativePose& relative);
void write(Lines& lines, const std::string& name, const WindowScore& score);
void write(Lines& lines, const std::string& name, const Sighting& sighting);
/// The marker's pose alone.
void write_pose(Lines& lines, const std::string& name, const Detection& marker);

}  // namespace berth::golden
