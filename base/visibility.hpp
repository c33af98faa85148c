// What libtakt.so exports. It is built with hidden visibility, and exports what stands in a
// namespace that one of the first two macros opens:
//
//     namespace TAKT_PUBLIC takt {
//
// Decision 0031 says why. The headers with TAKT_PUBLIC are the ones that are installed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_VISIBILITY_HPP_
#define TAKT_BASE_VISIBILITY_HPP_

/// The interface of the library.
#define TAKT_PUBLIC [[gnu::visibility("default")]]
/// Exported for Takt's own command, benchmarks and tests. It may change in any version.
#define TAKT_INTERNAL [[gnu::visibility("default")]]

#endif  // TAKT_BASE_VISIBILITY_HPP_
