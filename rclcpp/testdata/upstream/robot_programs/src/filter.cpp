// A chain of filters, which pluginlib loads from their library.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "filters/filter_chain.hpp"
#include "rclcpp/rclcpp.hpp"

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>(
      "filter", rclcpp::NodeOptions().parameter_overrides(
                    {{"chain.filter1.name", "mean"},
                     {"chain.filter1.type", "filters/MeanFilterDouble"},
                     {"chain.filter1.params.number_of_observations", 4}}));
  filters::FilterChain<double> chain("double");
  if (!chain.configure("chain", node->get_node_logging_interface(),
                       node->get_node_parameters_interface())) {
    return 1;
  }
  double mean = 0;
  for (const double value : {1.0, 2.0, 3.0, 4.0, 5.0}) chain.update(value, mean);
  std::printf("mean of the last four: %.2f\n", mean);
  rclcpp::shutdown();
}
