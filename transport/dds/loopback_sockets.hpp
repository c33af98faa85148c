// Cyclone's sockets, kept on the loopback interface.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_LOOPBACK_SOCKETS_HPP_
#define TAKT_TRANSPORT_DDS_LOOPBACK_SOCKETS_HPP_

#include <string>

namespace takt {

/// Cyclone 0.10 binds the sockets by which it receives to every address, whatever interface it is
/// configured for, and takes what comes to them. This makes the kernel drop what does not come over
/// the loopback interface, for all sockets of this process on the ports of this domain. Returns why
/// that could not be done; empty: it was.
/// Thread safety: from any thread. Real-time: no.
std::string keep_on_loopback(int domain);

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_LOOPBACK_SOCKETS_HPP_
