// SPDX-License-Identifier: Apache-2.0
#include "takt/base/logger.hpp"

#include <pthread.h>

#include <cstdio>
#include <mutex>

namespace takt {
namespace {

void write_to_stderr(LogLevel level, std::string_view line) {
  static constexpr const char* kNames[] = {"debug", "info", "warn", "error"};
  fmt::print(stderr, "[{}] {}\n", kNames[static_cast<int>(level)], line);
}

}  // namespace

Logger& Logger::instance() {
  static Logger logger;
  return logger;
}

Logger::Logger()
    : records_(Pool<Record>::create(kRecords,
                                    [](std::uint32_t) { return std::make_unique<Record>(); })),
      writer_(write_to_stderr) {}

Logger::~Logger() {
  stop_.store(true);
  work_.fetch_add(1);
  work_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Logger::start(const std::function<void()>& prepare) {
  if (started_.load(std::memory_order_acquire)) return;  // pairs with the store below
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (started_.load()) return;
  thread_ = std::thread([this, prepare] {
    pthread_setname_np(pthread_self(), "log");
    if (prepare) prepare();
    write_until_stopped();
  });
  started_.store(true, std::memory_order_release);
}

void Logger::hand_over(Record& record) noexcept {
  handed_over_.fetch_add(1, std::memory_order_relaxed);
  inbox_.push(record);
  work_.fetch_add(1);
  work_.notify_one();
}

void Logger::write_until_stopped() {
  std::uint64_t dropped_told = 0;
  for (;;) {
    const std::uint32_t seen = work_.load();
    const bool stopping = stop_.load();
    for (Record* record = inbox_.take_all(); record != nullptr;) {
      Record* next = record->inbox_next;
      writer_(record->level, std::string_view(record->text, record->size));
      Pool<Record>::recycle(*record);
      written_.fetch_add(1);
      written_.notify_all();
      record = next;
    }
    if (const std::uint64_t dropped = this->dropped(); dropped != dropped_told) {
      writer_(LogLevel::warn, fmt::format("{} log lines were dropped: more than {} at once",
                                          dropped - dropped_told, kRecords));
      dropped_told = dropped;
    }
    if (stopping) return;
    work_.wait(seen);
  }
}

void Logger::flush() {
  const std::uint64_t target = handed_over_.load();
  for (std::uint64_t written; (written = written_.load()) < target;) written_.wait(written);
}

void Logger::set_writer(std::function<void(LogLevel, std::string_view)> writer) {
  writer_ = writer ? std::move(writer) : write_to_stderr;
}

}  // namespace takt
