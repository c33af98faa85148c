// Services and clients.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/world.hpp"

namespace takt::sequences {
namespace {

constexpr std::size_t kMostCalls = 4, kMostOwed = 8;
constexpr std::array<Nanoseconds, 7> kTimeouts{
    0ms, 1ms, 10ms, 1s, 1ns, kCentury, Nanoseconds::max()};
// The clock moves a little between what the library and the model read.
constexpr Nanoseconds kSlack = 1ms;

}  // namespace

void World::make_service() {
  const int topic = next() % 2;
  const std::uint8_t way = next() % 3;
  make_part([&](Place& place, const PartPtr& part, const std::string&) {
    part->topic = topic;
    part->answers_at_once = way == 0;
    const auto& group = part->group->group;
    if (way == 0) {
      const Api::Serve serve = [this, part](const Twice::Request& request,
                                            Twice::Response& response) {
        response.value = 2 * request.value;
        ran(part);
      };
      part->service = api_.make_service(place.node, kServices[topic], serve, group);
    } else if (way == 1) {
      const Api::ServeLater remember = [this, part](const Twice::Request& request, RequestId id) {
        if (part->owed.size() < kMostOwed) part->owed.emplace_back(id, request.value);
        ran(part);
      };
      part->service = api_.make_service(place.node, kServices[topic], remember, group);
    } else {
      part->service = place.node->create_service<Twice>(
          kServices[topic],
          [this, part](const Twice::Request& request, Twice::Response& response) -> Task<> {
            ran(part);
            response.value = 2 * request.value;
            return task(part, /*what=*/0);
          },
          group);
    }
  });
}

void World::make_client() {
  const int topic = next() % 2;
  const Nanoseconds timeout = kTimeouts[next() % kTimeouts.size()];
  make_part([&](Place& place, const PartPtr& part, const std::string&) {
    part->topic = topic;
    ClientOptions options{.calls_in_flight = kMostCalls, .timeout = timeout};
    part->client = api_.make_client(place.node, kServices[topic], options, part->group->group);
    part->timeout = options.timeout;
    part->without_service = options.without_service;
  });
}

std::shared_ptr<Call> World::begin_call(Part& client) {
  auto call = std::make_shared<Call>();
  call->number = ++named_;
  call->lonely_end = later(clock_.now(), client.without_service);
  if (client.timeout != 0ms) call->deadline = later(clock_.now(), client.timeout);
  return call;
}

void World::sent(const PartPtr& client, const std::shared_ptr<Call>& call) {
  client->calls.push_back(call);
  for (const PartPtr& part : parts_) {
    if (part->service == nullptr || part->topic != client->topic) continue;
    ++part->published;
    if (part->answers_at_once) call->services.push_back(part);
  }
}

// Called first in the callback of the answer, whatever that does afterwards.
void World::answered(const PartPtr& client, Call& call, const Twice::Response* response) {
  demand(call.answers++ == 0, "a call was answered twice");
  std::erase_if(client->calls, [&](const auto& known) { return known.get() == &call; });
  if (response != nullptr) {
    demand(response->value == 2 * call.number, "a call got the answer of another");
  } else {
    demand(std::min(call.deadline, call.lonely_end) <= clock_.now(),
           "a call ended without an answer before its time");
  }
}

void World::send_request() {
  const PartPtr client = any_with(&Part::client);
  if (client == nullptr) return;
  const bool drops = next() % 4 == 0;
  const auto call = begin_call(*client);
  attempt([&] {
    api_.send_request(client->client, call->number,
                      [this, client, call, drops](const Twice::Response* response) {
                        const Inside inside = enter(client);
                        answered(client, *call, response);
                        if (drops) let_go(client);
                        act(client);
                      });
    sent(client, call);
  });
}

void World::wait_for_answer() {
  const PartPtr client = any_with(&Part::client);
  if (client == nullptr) return;
  const auto call = begin_call(*client);
  std::unique_ptr<Asked> asked;
  attempt([&] {
    asked = api_.ask(client->client, call->number);
    sent(client, call);
  });
  if (asked == nullptr) return;
  call->is_awaited = true;  // until the model has looked
  FutureReturnCode code{};
  const bool is_whole = spin([&] { code = asked->spin(*executor_, kLimits[2]); });
  if (is_whole) {
    demand((code == FutureReturnCode::SUCCESS) == asked->is_ready(),
           "a spin reported a wrong state of a future");
  }
  // Nobody looks at it later.
  if (!asked->is_ready()) return;
  const Twice::Response* const answer = asked->answer();
  if (answer != nullptr || !client->is_dropped) answered(client, *call, answer);
}

void World::respond() {
  const PartPtr service = any_with(&Part::service);
  if (service == nullptr || service->owed.empty()) return;
  const auto [id, number] = service->owed.front();
  service->owed.erase(service->owed.begin());
  api_.respond(service->service, id, 2 * number);
}

// For a client that is in the executor, much later.
void World::check_lonely_calls(const Part& client, TimePoint begin) {
  for (const PartPtr& part : parts_) {
    if (part->service != nullptr && part->topic == client.topic) return;
  }
  for (const auto& call : client.calls) {
    const bool is_old = !is_for_ever(client.without_service) &&
                        call->lonely_end <= later(begin, client.without_service);
    demand(call->is_awaited || !is_old, "a call did not end, though no service is left");
  }
}

// For a client that is in the executor, after a spin that ran to its end.
void World::check_calls(const Part& client, TimePoint begin) {
  const std::size_t in_flight = client.client->calls_in_flight();
  std::size_t open = 0;
  for (const auto& call : client.calls) {
    if (!call->is_awaited) ++open;
    if (call->is_awaited) continue;
    demand(are_held_ || later(call->deadline, kSlack) > begin, "a call did not end in its time");
    for (const auto& weak : call->services) {
      const PartPtr service = weak.lock();
      const bool owes = service != nullptr && is_in_executor(*service) && !service->has_thrown &&
                        service->service->lost() == 0 && client.client->lost() == 0;
      demand(!owes, "a call was not answered by a service that answers");
    }
  }
  demand(in_flight >= open && in_flight <= client.calls.size(),
         "a client has other calls in flight than were sent and not answered");
}

}  // namespace takt::sequences
