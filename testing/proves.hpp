// A test names the sentence of docs/reference that it proves.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_PROVES_HPP_
#define TAKT_TESTING_PROVES_HPP_

#include <string>
#include <string_view>

namespace takt {

/// Fails the test unless these words stand in docs/reference/`page`.
/// tools/takt/tests/claims_test.py looks for the calls: each sentence there that promises an error
/// has exactly one, here or by proves() of cmake/checks.py. Thread safety: none needed. Real-time:
/// no.
void proves(const std::string& page, std::string_view words);

}  // namespace takt

#endif  // TAKT_TESTING_PROVES_HPP_
