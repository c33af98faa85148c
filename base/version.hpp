// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_VERSION_HPP_
#define TAKT_BASE_VERSION_HPP_

/// Of these headers. CMake and the packages read it here.
#define TAKT_VERSION "0.1.0"

#endif  // TAKT_BASE_VERSION_HPP_
