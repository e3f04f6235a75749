// SPDX-License-Identifier: Apache-2.0
// Number of memory allocations of this program.
#pragma once

namespace dpde::test {

long allocations();

}  // namespace dpde::test
