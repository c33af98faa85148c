// SPDX-License-Identifier: Apache-2.0
#include "bench/reference_system.hpp"

#include <cstdint>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using nlohmann::json;

/// Writes a timeline as takt run --trace does.
class Timeline {
 public:
  void timer(const std::string& node, double ms, std::uint64_t chain) {
    add(fmt::format("/{0}/{0}_timer", node), "timer", ms, chain, 0);
  }
  void message(const std::string& node, const std::string& topic, double ms, std::uint64_t chain,
               int lost = 0) {
    add(fmt::format("/{}//{}", node, topic), "subscription", ms, chain, lost);
  }
  /// From the fusion's input to the planner's cache.
  void to_planner(double ms, std::uint64_t chain, int lost = 0) {
    message("RayGroundFilter", "PointCloudFusion", ms, chain, lost);
    message("EuclideanClusterDetector", "RayGroundFilter", ms + 1, chain);
    message("ObjectCollisionEstimator", "EuclideanClusterDetector", ms + 2, chain);
    message("BehaviorPlanner", "ObjectCollisionEstimator", ms + 3, chain);
  }
  /// From the planner's timer to the command.
  void to_command(double ms, std::uint64_t chain) {
    timer("BehaviorPlanner", ms, chain);
    message("MPCController", "BehaviorPlanner", ms + 1, chain);
    message("VehicleInterface", "BehaviorPlanner", ms + 2, chain);
    message("VehicleInterface", "MPCController", ms + 3, chain);
    message("VehicleDBWSystem", "VehicleInterface", ms + 4, chain);
  }
  /// What arrives at the other command node.
  void settings(int count, double ms) {
    for (int i = 0; i < count; ++i) {
      message("IntersectionOutput", "EuclideanIntersection", ms + i * 0.01, 9000);
    }
  }
  /// Front and rear lidar, fused 2 ms after `ms`; the rear one starts 1 ms later.
  void lidars(double ms, std::uint64_t front, std::uint64_t rear) {
    timer("FrontLidarDriver", ms, front);
    timer("RearLidarDriver", ms + 1, rear);
    message("PointsTransformerFront", "FrontLidarDriver", ms + 1.1, front);
    message("PointsTransformerRear", "RearLidarDriver", ms + 1.2, rear);
    message("PointCloudFusion", "PointsTransformerRear", ms + 1.3, rear);
    message("PointCloudFusion", "PointsTransformerFront", ms + 2, front);
  }
  std::map<std::string, double> figures() const {
    return reference_figures({}, {{"traceEvents", events_}});
  }

 private:
  void add(const std::string& name, const char* kind, double ms, std::uint64_t chain, int lost) {
    events_.push_back({{"ph", "X"},
                       {"name", name},
                       {"cat", kind},
                       {"ts", ms * 1e3},
                       {"args", {{"chain_instance", chain}, {"lost", lost}}}});
    events_.push_back({{"ph", "X"}, {"name", "planning"}, {"cat", "sched"}, {"ts", ms * 1e3}});
  }

  json events_ = json::array();
};

TEST(ReferenceFigures, CountTheHotPathFromTheLaterLidarsStartToTheEstimatorsStart) {
  Timeline timeline;
  timeline.settings(9, 0);
  timeline.lidars(100, 1, 2);
  timeline.to_planner(110, 1);
  timeline.to_command(150, 3);
  const auto figures = timeline.figures();
  EXPECT_EQ(figures.at("hot_path_samples"), 1);
  // The front lidar's message came last, but the rear lidar started later, at 101.
  EXPECT_NEAR(figures.at("hot_path_ms"), 112 - 101, 1e-9);
  EXPECT_EQ(figures.at("hot_path_drops"), 0);
}

TEST(ReferenceFigures, SkipTheFirstNineSamplesOfBothCommandNodes) {
  Timeline timeline;
  timeline.settings(8, 0);
  for (std::uint64_t i = 0; i < 3; ++i) {
    const double ms = 100.0 * static_cast<double>(i + 1);
    timeline.lidars(ms, 10 * i + 1, 10 * i + 2);
    timeline.to_planner(ms + 10 + static_cast<double>(i), 10 * i + 1);
    timeline.to_command(ms + 50, 10 * i + 3);
  }
  const auto figures = timeline.figures();
  EXPECT_EQ(figures.at("hot_path_samples"), 2);  // the first one was the ninth arrival
  EXPECT_NEAR(figures.at("hot_path_ms"), 12.5, 1e-9);
  EXPECT_NEAR(figures.at("hot_path_max_ms"), 13, 1e-9);
}

TEST(ReferenceFigures, CountTheSamplesThatReachTheCommandOnly) {
  Timeline timeline;
  timeline.settings(9, 0);
  timeline.lidars(100, 1, 2);
  timeline.to_planner(110, 1, 7);  // replaced in the planner's cache, with its drops
  timeline.lidars(200, 11, 12);
  timeline.to_planner(220, 11);
  timeline.to_command(250, 13);
  timeline.to_command(350, 23);  // nothing new to plan with: no sample of the hot path
  const auto figures = timeline.figures();
  EXPECT_EQ(figures.at("hot_path_samples"), 1);
  EXPECT_NEAR(figures.at("hot_path_ms"), 222 - 201, 1e-9);
  EXPECT_EQ(figures.at("hot_path_drops"), 0);
}

TEST(ReferenceFigures, DropsAreOfQueuesAndOfTheFusionsCacheOnTheHotPath) {
  Timeline timeline;
  timeline.settings(9, 0);
  timeline.timer("RearLidarDriver", 50, 4);
  timeline.message("PointsTransformerRear", "RearLidarDriver", 51, 4);
  timeline.message("PointCloudFusion", "PointsTransformerRear", 52, 4);  // replaced below: 1
  timeline.lidars(100, 1, 2);
  timeline.message("MPCController", "BehaviorPlanner", 105, 99, 50);  // not on the hot path
  timeline.to_planner(110, 1, 3);
  timeline.to_command(150, 3);
  EXPECT_EQ(timeline.figures().at("hot_path_samples"), 1);
  EXPECT_EQ(timeline.figures().at("hot_path_drops"), 4);
}

TEST(ReferenceFigures, DeviationOfThePlannersPeriod) {
  Timeline timeline;
  timeline.settings(9, 0);
  std::uint64_t chain = 1;
  for (const double ms : {100.0, 198.0, 300.0, 400.0}) timeline.to_command(ms, chain++);
  EXPECT_NEAR(timeline.figures().at("planner_deviation_ms"), 2.0, 1e-9);  // 98, 102, 100
}

}  // namespace
}  // namespace takt::tools
