// Asks nodes for the descriptions of their types.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ROS2_TYPE_DESCRIPTION_CLIENT_HPP_
#define TAKT_ROS2_TYPE_DESCRIPTION_CLIENT_HPP_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/nodes/node.hpp"

namespace TAKT_INTERNAL takt {

/// Asks the nodes that publish or subscribe to a type for its description, by their service
/// `get_type_description`: one node after the other, two seconds each. Nothing blocks; a timer of
/// the host looks for nodes and answers while something is asked.
///
/// Thread safety: one thread at a time, that of the host's default callback group; `ask` calls the
/// callback there, at once or later.
/// Real-time: no.
class TypeDescriptionClient {
 public:
  /// nullptr: no node describes the type.
  using Callback = std::function<void(const TypeDescription*)>;

  /// The host must have a participant, and outlive this object.
  explicit TypeDescriptionClient(Node& host);
  ~TypeDescriptionClient();
  TypeDescriptionClient(const TypeDescriptionClient&) = delete;
  TypeDescriptionClient& operator=(const TypeDescriptionClient&) = delete;

  void ask(std::string type, Callback callback);

 private:
  struct Question;
  void look();
  bool goes_on(Question& question, const Graph& graph);
  bool ask_next(Question& question, const Graph& graph);
  void send(Question& question);

  Node& host_;
  const std::shared_ptr<Timer> timer_;
  std::vector<std::unique_ptr<Question>> questions_;
};

}  // namespace takt

#endif  // TAKT_ROS2_TYPE_DESCRIPTION_CLIENT_HPP_
