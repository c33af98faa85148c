// SPDX-License-Identifier: Apache-2.0
#include "takt/testing/proves.hpp"

#include <fstream>

#include <gtest/gtest.h>

namespace takt {

void proves(const std::string& page, std::string_view words) {
  std::ifstream file(TAKT_REFERENCE_PAGES + page);
  std::string text;  // of one line
  for (std::string word; file >> word;) text += word + " ";
  EXPECT_NE(text.find(words), std::string::npos) << page << " does not say: " << words;
}

}  // namespace takt
