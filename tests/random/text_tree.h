// SPDX-License-Identifier: Apache-2.0
// Trees of texts: a text with holes that contain texts. Random models are such trees, so that parts can be removed or
// simplified without a parser.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace dpde::testing {

struct Part {
  enum class Kind {
    fixed,       // stays as long as its parent
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

/// A small text for which `fails` is still true. Parts are removed one at a time or all that contain a name, then the
/// last axis of the grid; then expressions are made smaller. `fails` is called at most `most` times, and not after the
/// time limit in seconds. It must be false for invalid texts.
Part shrink(Part whole, const std::function<bool(const std::string&)>& fails, int most, double seconds = 60);

}  // namespace dpde::testing
