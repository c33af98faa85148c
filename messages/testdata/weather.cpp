// A library with message types and a component: message_types_test.cpp and types_test.py load it.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"
#include "takt/messages/message_types.hpp"

#include "weather/msg/station.hpp"
#include "weather/srv/calibrate.hpp"

namespace weather {

struct Wind {
#ifdef TAKT_TEST_OTHER_WIND
  double knots = 0;
#endif
  double speed = 0;
  std::string from;
};
#ifdef TAKT_TEST_OTHER_WIND
TAKT_MESSAGE(Wind, "weather/msg/Wind", knots, speed, from);
#else
TAKT_MESSAGE(Wind, "weather/msg/Wind", speed, from);
#endif

/// Sends what it receives, and answers.
class Roof : public takt::Node {
 public:
  explicit Roof(const takt::NodeOptions& options) : Node("roof", options) {
    station_ = create_publisher<msg::Station>("/station", takt::QoS(1));
    wind_in_ = create_subscription<Wind>("/wind_in", takt::QoS(10),
                                         [this](const Wind& wind) { last_ = wind; });
    wind_ = create_publisher<Wind>("/wind", takt::QoS(1));
    timer_ = create_timer("send", std::chrono::milliseconds(20), [this] {
      station_->publish(msg::Station().set__name("roof").set__celsius({18.5, 19}));
      wind_->publish(last_);
    });
    calibrate_ = create_service<srv::Calibrate>(
        "/calibrate",
        [](const srv::Calibrate::Request& request, srv::Calibrate::Response& response) {
          response.is_done = true;
          response.celsius = 20 + request.offset;
        });
  }

 private:
  Wind last_{.speed = 2.5, .from = "west"};
  std::shared_ptr<takt::Publisher<msg::Station>> station_;
  std::shared_ptr<takt::SubscriptionBase> wind_in_;
  std::shared_ptr<takt::Publisher<Wind>> wind_;
  std::shared_ptr<takt::Timer> timer_;
  std::shared_ptr<takt::Service<srv::Calibrate>> calibrate_;
};

}  // namespace weather

TAKT_REGISTER_MESSAGES(weather::Wind)
#ifdef TAKT_TEST_OTHER_WIND  // so that the wind is all in which the libraries clash
namespace weather {
using OtherRoof = Roof;
}
TAKT_REGISTER_COMPONENT(weather::OtherRoof)
#else
TAKT_REGISTER_COMPONENT(weather::Roof)
#endif
