// SPDX-License-Identifier: Apache-2.0
// Bytes by owner. An engine that is given one (EngineOptions::count) allocates and computes nothing: its memory is
// counted where a run would allocate it.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "dpde/runtime/owned_memory.h"

namespace dpde {

class MemoryCount {
 public:
  static constexpr const char* of_fields = "fields";

  /// Memory that stays until it is given back: by the same call with -bytes.
  void hold(const std::string& owner, double bytes);
  /// Memory of a program, for good. What programs share counts once.
  void hold(const std::vector<OwnedMemory>& owned);
  /// Memory that is needed for a moment, on top of all that is held now.
  void pass(const std::string& owner, double bytes);
  /// The largest memory of making a solver: solvers are made in the first run, when all else is allocated.
  void pass_making() { pass("the making of a solver", making_); }

  /// Most bytes at one time.
  double peak() const { return peak_; }
  /// Bytes of each owner at that time.
  const std::map<std::string, double>& shares() const { return shares_; }

 private:
  std::map<std::string, double> held_, shares_;
  std::set<std::string> shared_;  // OwnedMemory::shared that is held already
  double making_ = 0, peak_ = 0;
};

}  // namespace dpde
