// SPDX-License-Identifier: Apache-2.0
// How often this program has asked for memory.
#pragma once

namespace dpde::test {

long allocations();

}  // namespace dpde::test
