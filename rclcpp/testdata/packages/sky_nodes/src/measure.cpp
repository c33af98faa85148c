// SPDX-License-Identifier: Apache-2.0
#include <iostream>

double height_of_one_cloud();

int main() {
  std::cout << "the lowest cloud is at " << height_of_one_cloud() << " m\n";
}
