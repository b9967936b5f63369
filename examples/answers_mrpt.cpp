// Align two occupancy grids with MRPT's CGridMapAligner; examples/answers_mrpt.py calls it.
//
// answers_mrpt TARGET.png SOURCE.png RESOLUTION prints x, y [m], yaw [rad] and the goodness of the best pose of the
// source in the target, or nothing. Both pictures have the same resolution [m], and the origin is the lower left corner.

#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/poses/CPosePDFSOG.h>
#include <mrpt/slam/CGridMapAligner.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

using mrpt::maps::CMultiMetricMap;
using mrpt::maps::COccupancyGridMap2D;
using mrpt::maps::CSimplePointsMap;

// A grid, and its occupied cells as points for the ICP.
CMultiMetricMap load(const char* file, double resolution) {
    auto grid = COccupancyGridMap2D::Create();
    if (!grid->loadFromBitmapFile(file, resolution, {0.0, 0.0})) throw std::runtime_error(file);
    auto points = CSimplePointsMap::Create();
    grid->getAsPointCloud(*points);
    CMultiMetricMap map;
    map.maps.push_back(grid);
    map.maps.push_back(points);
    return map;
}

int main(int, char** arguments) {
    const double resolution = std::atof(arguments[3]);
    const auto target = load(arguments[1], resolution), source = load(arguments[2], resolution);
    mrpt::slam::CGridMapAligner aligner;
    aligner.setMinLoggingLevel(mrpt::system::LVL_ERROR);
    mrpt::slam::CGridMapAligner::TReturnInfo info;
    const auto found = aligner.AlignPDF(&target, &source, mrpt::poses::CPosePDFGaussian(), info);
    const auto modes = std::dynamic_pointer_cast<mrpt::poses::CPosePDFSOG>(found);
    if (!modes || modes->empty()) return 0;
    mrpt::poses::CPose2D pose;
    mrpt::math::CMatrixDouble33 covariance;
    modes->getMostLikelyCovarianceAndMean(covariance, pose);
    const auto& goodness = info.icp_goodness_all_sog_modes;
    const double best = goodness.empty() ? 0.0 : *std::max_element(goodness.begin(), goodness.end());
    std::printf("%.6f %.6f %.6f %.4f\n", pose.x(), pose.y(), pose.phi(), best);
}
