// A fake participant for other processes, which detects that its endpoints are destroyed too early.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_OUTSIDE_HPP_
#define TAKT_TESTING_OUTSIDE_HPP_

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "takt/transport/dds/participant.hpp"

namespace takt {

/// Simulates other processes for a subscription or service. A thread that asks for their writers
/// stays inside for 10 ms, or until the endpoint is destroyed: long enough to destroy it too early.
class Outside : public Participant {
 public:
  std::atomic<bool> is_asked{false}, is_inside{false}, is_gone{false}, went_inside{false};

  std::unique_ptr<RemoteWriter> create_writer(const Endpoint&,
                                              std::shared_ptr<EndpointEvents>) override {
    return nullptr;
  }
  std::unique_ptr<RemoteReader> create_reader(IntraProcessReader&) override {
    return std::make_unique<Callers>(*this);
  }
  bool serves_own_process() const noexcept override { return false; }
  const std::string& why_no_shared_memory() const noexcept override { return nothing_; }
  std::vector<EndpointState> endpoints() const override { return {}; }
  void visit_endpoints(const std::function<void(const Endpoint&)>&) const override {}
  void add_node(const std::string&) override {}
  void remove_node(const std::string&) override {}
  Graph graph() override { return {}; }
  const std::vector<ThreadState>& threads() const noexcept override { return threads_; }

 private:
  struct Callers : RemoteReader {
    explicit Callers(Outside& of) : outside(of) {}
    ~Callers() override {
      outside.went_inside.store(outside.is_inside.load());
      outside.is_gone.store(true);
    }
    std::size_t writer_count() const noexcept override {
      Outside& of = outside;
      of.is_inside.store(true);
      of.is_asked.store(true);
      for (int i = 0; i < 100 && !of.is_gone.load(); ++i)
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      of.is_inside.store(false);
      return 0;
    }
    std::uint64_t received() const noexcept override { return 7; }
    Outside& outside;
  };
  const std::string nothing_{};
  const std::vector<ThreadState> threads_{};
};

}  // namespace takt

#endif  // TAKT_TESTING_OUTSIDE_HPP_
