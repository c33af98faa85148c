// The order of bytes, under the name of rcpputils.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCPPUTILS__ENDIAN_HPP_
#define RCPPUTILS__ENDIAN_HPP_

#include <bit>

namespace rcpputils {
using std::endian;
}  // namespace rcpputils

#endif  // RCPPUTILS__ENDIAN_HPP_
