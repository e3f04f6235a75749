// SPDX-License-Identifier: Apache-2.0
// Persistent threads, for work in equal parts many thousand times a second.
//
//   Team team(2);
//   team.run(8, [&](std::int64_t part, int thread) { ... });   // parts 0 .. 7, each once; thread 0 is the caller
//
//  - Thread numbers are below threads() and `parts`: use them as keys for per-thread data. Each thread has a fixed
//    range of the parts, so that it finds its data in its caches; a thread that is done takes over parts that others
//    have not begun. A part does not depend on the thread that runs it: neither do results.
//  - A team never waits for a thread that has not begun. If parts took longer than on one thread, since other processes
//    use the cores, the caller works alone for a while (`Ledger` in team.cpp): several threads should never cost more
//    than a tenth over one. `bench_team` measures it.
// - Threads spin for microseconds, then they sleep. They have the floating-point mode of the caller.
//  - run() rethrows the exception of a part, the first part's if there are several; other parts may or may not have
//    run.
//  - Copies share the same team. Threads start with the first work; if the system provides fewer, fewer are used.
//    Nested work of the same team, or work of a second caller at the same time, runs on its caller as thread 0:
//    per-thread data must then belong to that call. run() allocates nothing.
#pragma once

#include <cstdint>
#include <memory>

namespace dpde {

class Team {
 public:
  /// Implicit: a number of threads can be passed as a team.
  Team(int threads = 1);
  /// The largest number of threads that work in parallel.
  int threads() const { return threads_; }
  /// Processor time of the helper threads so far, without the callers'.
  double helped_seconds() const;

  template <class F>
  void run(std::int64_t parts, const F& f) const {
    if (threads_ > 1 && parts > 1)
      return share(
          parts, [](const void* work, std::int64_t part, int thread) { (*static_cast<const F*>(work))(part, thread); },
          &f);
    for (std::int64_t part = 0; part < parts; ++part) f(part, 0);
  }

 private:
  using Call = void (*)(const void* work, std::int64_t part, int thread);
  class Crew;
  void share(std::int64_t parts, Call call, const void* work) const;

  int threads_;
  std::shared_ptr<Crew> crew_;  // null where there is one thread
};

}  // namespace dpde
