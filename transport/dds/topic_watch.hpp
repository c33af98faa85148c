// Says which endpoints of a topic in other processes do not match ours, and why.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_TOPIC_WATCH_HPP_
#define TAKT_TRANSPORT_DDS_TOPIC_WATCH_HPP_

#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/logger.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"
#include "takt/transport/dds/graph_reader.hpp"

namespace takt {

/// DDS does not match two endpoints of a topic whose types differ, and says nothing; of QoS it says
/// only the policy. So the ends that DDS discovers are compared with ours here, as they come. Each
/// pair is logged once: different types as an error, QoS that does not fit as a warning. So is a
/// node of ours, the first time that another process serves one of its services, too.
///
/// An end of ROS 2 does not say whose it is; its process announces that, perhaps later. A line
/// about such an end waits for the name, a second at most:
/// 1. Cyclone's thread for timed events asks for names that are known already. That also begins to
///    listen to announcements, which Cyclone's threads cannot do while they report an end.
/// 2. With the announcement of its process the line is completed: announced().
/// 3. The same thread as in 1 logs it without a name when its time is over, or end() does.
///
/// Thread safety: every method from any thread.
/// Real-time: no. Discovered ends are compared on Cyclone's threads.
class TopicWatch {
 public:
  /// `topic`: of the same domain; nullptr: nobody announces nodes. `names`: of nodes; it lives
  /// until end().
  TopicWatch(const Topic* topic, GraphReader& names);
  ~TopicWatch() { end(); }
  TopicWatch(const TopicWatch&) = delete;
  TopicWatch& operator=(const TopicWatch&) = delete;

  /// Throws Error when Cyclone refuses to report what it discovers.
  void begin(dds_entity_t participant);
  /// From here on it logs nothing.
  void end() noexcept;
  /// A process has announced its nodes.
  void announced(const std::string& process);
  /// One of ours, which lives until it is removed.
  void add(const Endpoint& endpoint, bool is_writer);
  void remove(const Endpoint& endpoint) noexcept;

 private:
  struct End {
    std::string type, node;
    QoS qos{1};
    bool is_writer = false;
  };
  struct Ends {
    std::map<const Endpoint*, End> ours;
    std::map<std::string, End> others;  // by the 16 bytes of the DDS GUID
  };
  void discover(dds_entity_t reader, bool writers) noexcept;
  void forget_if_empty(const std::string& name) noexcept;
  /// False: others have complained too often in this second, so that the line is left out.
  bool complain(LogLevel level, const std::string& line);
  bool compare(const std::string& topic, const End& ours, const End& other, const std::string& gid);
  bool compare_servers(const std::string& topic, const End& ours, const End& other,
                       const std::string& gid);
  /// A line that waits for the name of the other end's node.
  struct Unnamed {
    std::string topic;
    End ours, other;
    std::string gid;
    TimePoint until;
  };
  bool waits_for_name(const std::string& topic, const End& ours, const End& other,
                      const std::string& gid);
  void name(const std::string& process);
  void name_all() noexcept;

  GraphReader& names_of_nodes_;
  LogThrottle throttle_{10};  // others must not fill the log
  dds_instance_handle_t own_ = 0;
  std::mutex mutex_;
  std::map<std::string, Ends> topics_;        // by the name that it has in DDS
  std::map<std::string, std::string> names_;  // of the topics of the others' ends
  std::set<std::string> doubted_;             // nodes of ours with a service that others serve, too
  std::vector<Unnamed> unnamed_;
  std::optional<TimedCall> timer_;          // names them; without one no line waits
  dds_entity_t writers_ = 0, readers_ = 0;  // where Cyclone reports them
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_TOPIC_WATCH_HPP_
