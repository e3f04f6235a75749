// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/half_rows.h"

namespace dpde {

HalfRows::HalfRows(std::int64_t cells, bool is_ring, std::int64_t line) : cells_(cells), is_ring_(is_ring) {
  const auto rounded = [line](std::int64_t n) { return (n + line - 1) / line * line; };
  odd_ = rounded(count(0) + 2);
  stride_ = odd_ + rounded(count(1) + 1);
}

}  // namespace dpde
