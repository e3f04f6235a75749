// SPDX-License-Identifier: Apache-2.0
// Threads that stay, for work that comes in equal parts many thousand times a second.
//
//   Team team(2);
//   team.run(8, [&](std::int64_t part, int thread) { ... });   // parts 0 .. 7, each once; thread 0 is the caller
//
//  - Threads have numbers below threads() and `parts`: what they need for themselves can be kept under these. Each
//    has a range of the parts, always the same one, so that it finds in its caches what it left there; who is done
//    takes over what others have not begun. What a part is does not depend on the threads: neither do results.
//  - A team never waits for a thread that has not begun. Where parts took longer than they would have on one
//    thread, since other processes hold the cores, the caller works alone for a while (`Ledger` in team.cpp): the
//    aim is that several threads never cost more than a tenth over one. `bench_team` measures it.
//  - Threads spin for microseconds, then they sleep. They have the floating-point mode of the caller.
//  - What a part throws comes out of run(), that of the first part where there are several; other parts may be done
//    or not.
//  - Copies are the same team. Threads begin with the first work; where the system gives fewer, fewer it is. Work
//    asked for within work of the same team, or by two callers at once, is done by who asks, as thread 0: then what
//    parts keep under thread numbers must be their own call's. run() allocates nothing.
#pragma once

#include <cstdint>
#include <memory>

namespace dpde {

class Team {
 public:
  /// A number will do where a team is wanted.
  Team(int threads = 1);
  /// The largest number of threads at work at once.
  int threads() const { return threads_; }
  /// Of a processor, that threads beside those who asked have worked for them until now.
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
