// Cyclone's header of its domain is C, and no C++.
// SPDX-License-Identifier: Apache-2.0
#include <dds/ddsi/ddsi_domaingv.h>

struct xeventq* takt_timed_events(const struct ddsi_domaingv* domain);

struct xeventq* takt_timed_events(const struct ddsi_domaingv* domain) {
  return domain->xevents;
}
