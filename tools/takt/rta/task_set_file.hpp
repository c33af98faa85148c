// Task sets for textbook analyses, from JSON or YAML.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RTA_TASK_SET_FILE_HPP_
#define TAKT_TOOLS_TAKT_RTA_TASK_SET_FILE_HPP_

#include <string>

#include "takt/analysis/textbook/textbook.hpp"
#include "takt/containers/configuration/document.hpp"

namespace takt::tools {

/// What this analysis reads of the file. Throws ConfigurationError with all errors of the file:
/// also for a key that the analysis does not read, as it would have no effect. Thread safety: a
/// pure function. Real-time: no.
analysis::textbook::TaskSet read_task_set(const document::Value& file, const std::string& analysis,
                                          document::Errors& errors);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RTA_TASK_SET_FILE_HPP_
