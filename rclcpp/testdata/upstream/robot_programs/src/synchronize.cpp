// Messages of two topics that belong together, by equal and by near stamps.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <memory>

#include "geometry_msgs/msg/point_stamped.hpp"
#include "message_filters/subscriber.h"
#include "message_filters/sync_policies/approximate_time.h"
#include "message_filters/synchronizer.h"
#include "message_filters/time_synchronizer.h"
#include "rclcpp/rclcpp.hpp"

using Point = geometry_msgs::msg::PointStamped;

namespace {
int equal = 0, near = 0;

void came_exactly(const Point::ConstSharedPtr& a, const Point::ConstSharedPtr& b) {
  equal += a->header.stamp == b->header.stamp ? 1 : 1000;
}
void came_nearly(const Point::ConstSharedPtr& a, const Point::ConstSharedPtr& b) {
  if (a->point.x == b->point.x) ++near;
}
}  // namespace

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("synchronize");
  const auto left = node->create_publisher<Point>("left", 10);
  const auto right = node->create_publisher<Point>("right", 10);
  message_filters::Subscriber<Point> left_subscriber(node, "left"), right_subscriber(node, "right");

  message_filters::TimeSynchronizer<Point, Point> exact(left_subscriber, right_subscriber, 10);
  exact.registerCallback(came_exactly);
  using Approximate = message_filters::sync_policies::ApproximateTime<Point, Point>;
  message_filters::Synchronizer<Approximate> approximate(Approximate(10), left_subscriber,
                                                         right_subscriber);
  approximate.registerCallback(came_nearly);

  int sent = 0;
  const auto timer = node->create_wall_timer(std::chrono::milliseconds(10), [&] {
    if (sent == 40) return rclcpp::shutdown(), void();
    Point point;
    point.point.x = sent;
    point.header.stamp.sec = 1 + sent;
    left->publish(point);
    point.header.stamp.nanosec = sent % 2 == 0 ? 0 : 1000;  // every second one is late
    right->publish(point);
    ++sent;
  });
  rclcpp::spin(node);
  std::printf("%d equal, %s near\n", equal, near >= 35 ? "35 or more" : "too few");
}
