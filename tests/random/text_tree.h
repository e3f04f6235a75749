// SPDX-License-Identifier: Apache-2.0
// Texts with holes that hold texts: what a random model is made of, so that parts of it can be left out or made simpler
// without knowing the language.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace dpde::testing {

struct Part {
  enum class Kind {
    fixed,       // stays as long as what holds it
    item,        // may be left out
    expression,  // may be replaced by an expression inside of it, or by a number
    tuple,       // `parts` are components between commas; the last goes when the grid loses an axis
    list,        // `parts` are between commas, and may be left out as long as one is left
  };
  Kind kind = Kind::fixed;
  std::string text;  // each @ stands for the next one of `parts`; not looked at for tuples and lists
  std::vector<Part> parts = {};
};

inline Part item(std::string text, std::vector<Part> parts = {}) {
  return {Part::Kind::item, std::move(text), std::move(parts)};
}
inline Part expression(std::string text, std::vector<Part> parts = {}) {
  return {Part::Kind::expression, std::move(text), std::move(parts)};
}

std::string print(const Part& part);

/// The smallest text for which `fails` still holds: parts go, one at a time or all that hold a name, then the last axis
/// of the grid, then expressions become smaller. `fails` is asked at most `most` times, not after so many seconds, and
/// says no to texts that make no sense.
Part shrink(Part whole, const std::function<bool(const std::string&)>& fails, int most, double seconds = 60);

}  // namespace dpde::testing
