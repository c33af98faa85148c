// Probes for bpftrace and perf (USDT): an instruction that does nothing, until a tool watches it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_PROBES_HPP_
#define TAKT_BASE_PROBES_HPP_

/// `TAKT_PROBE(name, …)`: takt:name, with up to 12 numbers or pointers, which are computed always.
#if __has_include(<sys/sdt.h>)  // Debian 12: systemtap-sdt-dev
#define SDT_USE_VARIADIC
#include <sys/sdt.h>
#define TAKT_PROBE(...) STAP_PROBEV(takt, __VA_ARGS__)
#else
#define TAKT_PROBE(...) static_cast<void>(0)
#endif

#endif  // TAKT_BASE_PROBES_HPP_
