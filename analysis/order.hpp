// The orders for which there are analyses.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_ORDER_HPP_
#define TAKT_ANALYSIS_ORDER_HPP_

#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_PUBLIC analysis {

/// Which of the ready callbacks an executor runs next. A scheduler that fits none of these has an
/// arbitrary order, for which there are bounds, too.
enum class Order {
  arbitrary,
  by_urgency,  // the larger Callback::urgency first; equal ones anyhow, each in order of arrival
  by_arrival,  // messages as they were sent, a timer's release when the executor has looked
  by_point,    // the least of ready time + Callback::point first, then by arrival
  in_windows,  // what was seen at one polling point before what was seen at the next; inside, by
               // Callback::place
  in_turns,    // one callback of each Callback::group in turn; inside, by arrival
};

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_ORDER_HPP_
