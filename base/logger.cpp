// SPDX-License-Identifier: Apache-2.0
#include "takt/base/logger.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <mutex>
#include <thread>

#include <boost/lockfree/queue.hpp>
#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/blocked_signals.hpp"
#include "takt/base/clock.hpp"
#include "takt/base/never_destroyed.hpp"
#include "takt/base/printable.hpp"

namespace takt {
namespace {

void write_to_stderr(LogLevel level, std::string_view line) {
  static constexpr const char* kNames[] = {"debug", "info", "warn", "error"};
  // Not fmt::print: it throws when it cannot write, and the exception would end the process.
  const std::string text = fmt::format("[{}] {}\n", kNames[static_cast<int>(level)], line);
  std::fwrite(text.data(), 1, text.size(), stderr);
}

// The log thread does not keep the attributes of the thread that happens to start it.
void take_default_attributes() {
  const sched_param no_priority{};
  sched_setscheduler(0, SCHED_OTHER, &no_priority);
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), 0);
  use_available_cpus();
}

}  // namespace

std::optional<std::uint64_t> LogThrottle::may_log() noexcept {
  const std::int64_t now_ns = Clock::steady().now().time_since_epoch().count();
  std::int64_t last_ns = last_ns_.load();
  if (now_ns - last_ns >= 1'000'000'000 && last_ns_.compare_exchange_strong(last_ns, now_ns)) {
    count_.store(1);
    return left_out_.exchange(0);
  }
  if (count_.fetch_add(1) < most_) return left_out_.exchange(0);
  left_out_.fetch_add(1);
  return std::nullopt;
}

struct Logger::EndOfProcess {
  explicit EndOfProcess(Logger& of_process) : logger(of_process) {}
  ~EndOfProcess() { logger.stop(); }
  Logger& logger;
};

Logger& Logger::instance() {
  static detail::NeverDestroyed<Logger> logger;
  static const EndOfProcess end(*logger);
  return *logger;
}

// The queue of lines, by value. Logging threads do not wait for each other and do not allocate.
struct Logger::Output {
  boost::lockfree::queue<Record, boost::lockfree::capacity<kRecords>> queue;
  std::thread thread;
  std::mutex one_at_a_time;  // for functions in the log thread, and for its end
  std::atomic<bool> is_writing{false};

  /// After stop(), logging threads write themselves, one at a time. The loop also writes lines that
  /// came meanwhile, even those logged by the writer.
  template <class Write>
  void write_at_the_end(const Write& write) {
    while (!queue.empty() && !is_writing.exchange(true)) {
      write();
      is_writing.store(false);
    }
  }
};

Logger::Logger() : output_(std::make_unique<Output>()), writer_(write_to_stderr) {
}

void Logger::stop() {
  const std::lock_guard one(output_->one_at_a_time);  // no run_in_thread is under way
  const std::lock_guard lock(starting_);
  stopping_.store(true);
  work_.fetch_add(1);
  work_.notify_one();
  if (output_->thread.joinable()) output_->thread.join();
  started_.store(true);
  stopped_.store(true);
  output_->write_at_the_end([this] { write_what_waits(); });
}

void Logger::start() {
  if (started_.load(std::memory_order_acquire)) return;  // pairs with the store below
  const std::lock_guard lock(starting_);
  if (started_.load()) return;
  const BlockedSignals in_its_thread;
  output_->thread = std::thread([this] {
    pthread_setname_np(pthread_self(), "log");
    take_default_attributes();
    write_until_stopped();
  });
  started_.store(true, std::memory_order_release);
}

void Logger::run_in_thread(const std::function<void()>& function) {
  const std::lock_guard lock(output_->one_at_a_time);
  start();
  if (stopped_.load()) return function();
  std::exception_ptr thrown;
  const std::function<void()> caught = [&] {
    try {
      function();
    } catch (...) {
      thrown = std::current_exception();
    }
  };
  function_.store(&caught);
  work_.fetch_add(1);
  work_.notify_one();
  function_.wait(&caught);
  if (thrown) std::rethrow_exception(thrown);
}

// False: the queue of lines is full.
bool Logger::take_room() noexcept {
  start();
  std::size_t taken = taken_.load(std::memory_order_relaxed);
  while (taken < kRecords) {
    if (taken_.compare_exchange_weak(taken, taken + 1)) return true;
  }
  dropped_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

void Logger::write(std::string_view source, LogLevel level, const SourceLocation& where,
                   fmt::string_view format, fmt::format_args arguments) {
  Record record;
  record.where = where;
  std::size_t begin = 0;
  if (!source.empty()) {
    const auto end = fmt::format_to_n(record.text, kLineBytes, "{}: ", source);
    begin = std::min<std::size_t>(end.size, kLineBytes);
  }
  const auto end = fmt::vformat_to_n(record.text + begin, kLineBytes - begin, format, arguments);
  record.size = std::min<std::size_t>(begin + end.size, kLineBytes);
  record.source_size = source.size();
  if (take_room()) hand_over(level, record);  // only now, as a formatter may throw
}

void Logger::set_listener(std::function<void(const LogLine&)> listener) {
  run_in_thread([&] { listener_.swap(listener); });
}

void Logger::hand_over(LogLevel level, Record& record) noexcept {
  record.level = level;
  record.time = std::chrono::system_clock::now();
  handed_over_.fetch_add(1, std::memory_order_relaxed);
  output_->queue.push(record);  // cannot fail: take_room() reserved a place
  if (stopped_.load()) return output_->write_at_the_end([this] { write_what_waits(); });
  work_.fetch_add(1);
  work_.notify_one();
}

void Logger::write_until_stopped() {
  for (;;) {
    const std::uint32_t seen = work_.load();
    const bool stopping = stopping_.load();
    if (const auto* function = function_.load()) {
      (*function)();
      function_.store(nullptr);
      function_.notify_one();
    }
    write_what_waits();
    if (stopping) return;
    work_.wait(seen);
  }
}

void Logger::write_what_waits() {
  // Limited, as other threads may log without end.
  Record record;
  for (std::size_t i = 0; i < kRecords && output_->queue.pop(record); ++i) write_line(record);
  if (const std::uint64_t dropped = this->dropped(); dropped != dropped_reported_) {
    writer_(LogLevel::warn, fmt::format("{} log lines were dropped: more than {} at once",
                                        dropped - dropped_reported_, kRecords));
    dropped_reported_ = dropped;
  }
}

void Logger::write_line(const Record& record) {
  const std::string_view line(record.text, record.size);
  writer_(record.level, printable(line));  // untrusted input: names of other processes
  if (listener_ && !stopped_.load()) {     // after stop, objects of the listener may be gone
    const bool has_source = record.source_size != 0 && record.source_size + 2 <= line.size();
    listener_({record.level, record.time,
               has_source ? line.substr(0, record.source_size) : std::string_view(),
               has_source ? line.substr(record.source_size + 2) : line, record.where});
  }
  taken_.fetch_sub(1);
  written_.fetch_add(1);
  written_.notify_all();
}

void Logger::flush() {
  const std::uint64_t target = handed_over_.load();
  for (std::uint64_t written; (written = written_.load()) < target;) written_.wait(written);
}

void Logger::set_writer(std::function<void(LogLevel, std::string_view)> writer) {
  if (!writer) writer = write_to_stderr;
  flush();
  run_in_thread([&] { writer_.swap(writer); });
}

}  // namespace takt
