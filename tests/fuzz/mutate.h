// SPDX-License-Identifier: Apache-2.0
// Texts that are nearly right: a few tokens or bytes of one changed, with what is found in others.
#pragma once

#include <string>
#include <vector>

#include "support/split_mix.h"

namespace dpde::testing {

class Mutator {
 public:
  /// Not empty; the texts too.
  explicit Mutator(std::vector<std::string> corpus) : corpus_(std::move(corpus)) {}
  std::string operator()(SplitMix& random) const;

 private:
  std::vector<std::string> corpus_;
};

}  // namespace dpde::testing
