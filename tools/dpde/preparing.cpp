// SPDX-License-Identifier: Apache-2.0
#include "preparing.h"

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <system_error>
#include <utility>

#include "interrupt.h"

namespace dpde::tools {

namespace {

constexpr std::chrono::milliseconds between_looks{50};

/// A compiler that still writes may make the first attempts fail.
void remove_folder(const std::filesystem::path& folder) {
  std::error_code error;
  for (int attempt = 0; attempt < 10; ++attempt) {
    std::filesystem::remove_all(folder, error);
    if (!error) return;
    std::this_thread::sleep_for(between_looks / 10);
  }
}

}  // namespace

Preparing::Preparing(const Job& job, std::string stopped) : options_(job.options()), stopped_(std::move(stopped)) {
  interrupt_flag();  // installs the handlers before the folder exists
  if (options_.backend == "cpp") {
    folder_ = std::make_unique<TemporaryFolder>();
    const char* set = std::getenv("TMPDIR");
    temporary_ = set == nullptr ? "" : set;
    if (!folder_->path().empty()) setenv("TMPDIR", folder_->path().c_str(), 1);
  }
  watcher_ = std::jthread([this](const std::stop_token& done) { watch(done); });
}

Preparing::~Preparing() {
  watcher_.request_stop();
  watcher_.join();
  if (interrupt_flag().load()) end();  // a compiler ended by the same signal is not an error
  if (!folder_) return;
  if (temporary_.empty()) {
    unsetenv("TMPDIR");
  } else {
    setenv("TMPDIR", temporary_.c_str(), 1);
  }
}

void Preparing::watch(const std::stop_token& done) const {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  while (!interrupt_flag().load()) {
    if (wake.wait_for(lock, done, between_looks, [&] { return done.stop_requested(); })) return;
  }
  end();
}

void Preparing::end() const {
  if (folder_) remove_folder(folder_->path());
  Job last(options_);
  last.sink().report("run-failed", {}, {stopped_});
  _exit(status_or_signal(last.finish(Json::object())));
}

}  // namespace dpde::tools
